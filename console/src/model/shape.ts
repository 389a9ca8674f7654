/** A triangle mesh as palpate/session/shape.h lays it down. */
export interface Shape {
  frame: number;
  positions_mm: Float32Array;
  stress_kPa: Float32Array;
  /** 1 = fixed, 2 = was not seen. */
  flags: Uint32Array;
  triangles: Uint32Array;
}

export function parseShape(bytes: ArrayBuffer): Shape | null {
  const head = new DataView(bytes);
  if (bytes.byteLength < 16 || head.getUint32(0, true) !== 0x31485350) return null;
  const nodes = head.getUint32(8, true), triangles = head.getUint32(12, true);
  if (bytes.byteLength < 16 + nodes * 20 + triangles * 12) return null;
  return {
    frame: head.getInt32(4, true),
    positions_mm: new Float32Array(bytes, 16, nodes * 3),
    stress_kPa: new Float32Array(bytes, 16 + nodes * 12, nodes),
    flags: new Uint32Array(bytes, 16 + nodes * 16, nodes),
    triangles: new Uint32Array(bytes, 16 + nodes * 20, triangles * 3),
  };
}

export async function fetchShape(url: string): Promise<Shape | null> {
  const answer = await fetch(url);
  return answer.ok ? parseShape(await answer.arrayBuffer()) : null;
}
