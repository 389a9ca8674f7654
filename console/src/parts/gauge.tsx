import type {Row} from '../model/types';

const kScales_N = [0.2, 0.5, 1, 2, 5, 10, 20, 50];
const kStart = -210, kSweep = 240;

function scaleFor(peak: number): number {
  return kScales_N.find((scale) => peak <= scale) ?? Math.pow(10, Math.ceil(Math.log10(peak)));
}

function onArc(fraction: number, radius: number): [number, number] {
  const angle = ((kStart + kSweep * Math.min(1, Math.max(0, fraction))) * Math.PI) / 180;
  return [100 + radius * Math.cos(angle), 100 + radius * Math.sin(angle)];
}

function arc(from: number, to: number, radius: number): string {
  const [x0, y0] = onArc(from, radius), [x1, y1] = onArc(to, radius);
  return `M${x0} ${y0}A${radius} ${radius} 0 ${(to - from) * kSweep > 180 ? 1 : 0} 1 ${x1} ${y1}`;
}

/** Where the force points, as the camera sees it: across the picture, and into it. */
function Direction({force}: {force: [number, number, number]}) {
  const [x, y, z] = force, length = Math.hypot(x, y, z);
  if (length < 1e-6) return <p class="direction">no direction</p>;
  const across = Math.hypot(x, y);
  const turn = (Math.atan2(y, x) * 180) / Math.PI;
  return (
    <p class="direction">
      <svg viewBox="0 0 44 44" width="44" height="44" aria-hidden="true">
        <circle cx="22" cy="22" r="20" class="ring" />
        <g transform={`rotate(${turn} 22 22)`}>
          <path class="arrow" d={`M22 22H${22 + 17 * (across / length)}`} />
          <path class="arrow head" d={`M${22 + 17 * (across / length) - 5} 17l5 5-5 5`} />
        </g>
      </svg>
      <span>
        {across.toFixed(2)} N across
        <br />
        {Math.abs(z).toFixed(2)} N {z >= 0 ? 'into' : 'out of'} the picture
      </span>
    </p>
  );
}

interface Props {
  row: Row | null;
  peak_N: number;
  unit: string;
  tissue: string;
}

/** The force that is asked about, never without its band, its direction and the tissue that it assumes. */
export function Gauge({row, peak_N, unit, tissue}: Props) {
  const isKnown = !!row && row.status !== 'tool_lost' && row.status !== 'not_converged';
  const force = isKnown ? row.magnitude_N : 0;
  const scale = scaleFor(Math.max(peak_N * 1.1, 0.15));
  return (
    <section class="gauge" aria-label="force">
      <svg viewBox="-8 -10 216 166" role="img" aria-label={`force ${force.toFixed(2)} ${unit}`}>
        <path class="track" d={arc(0, 1, 82)} />
        {isKnown && row.high_N > row.low_N && <path class="band" d={arc(row.low_N / scale, row.high_N / scale, 82)} />}
        {isKnown && force > 0 && <path class="value" d={arc(0, force / scale, 68)} />}
        {[0, 0.5, 1].map((fraction) => {
          const [x, y] = onArc(fraction, 97);
          return (
            <text key={fraction} x={x} y={y + 3} class="tick">
              {fraction * scale}
            </text>
          );
        })}
        <text x="100" y="104" class="reading" data-testid="force" data-frame={row?.frame}>
          {isKnown ? force.toFixed(2) : '–'}
        </text>
        <text x="100" y="124" class="unit">
          {unit}
        </text>
        <text x="100" y="143" class="band-text">
          {isKnown ? `95 %: ${row.low_N.toFixed(2)} to ${row.high_N.toFixed(2)}` : 'no force is known'}
        </text>
      </svg>
      {isKnown && row.in_contact ? <Direction force={row.force_N} /> : <p class="direction">no contact, no direction</p>}
      <p class="tissue">at {tissue}</p>
    </section>
  );
}
