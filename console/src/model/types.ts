/** What the program tells of itself, as palpate/console/state_json.cpp writes it. */
export type Phase = 'idle' | 'ready' | 'building' | 'running' | 'failed';

export type Yaml = string | Yaml[] | {[key: string]: Yaml};

export interface SceneState {
  file: string;
  text: string;
  values: {[key: string]: Yaml};
  saved: boolean;
  can_undo: boolean;
  can_redo: boolean;
  law: string;
  young_modulus: string;
  poisson_ratio: number;
  force_unit: string;
}

export interface SourceState {
  width: number;
  height: number;
  fps: number;
  frames: number;
  frame: number;
  focal_px: number;
  baseline_mm: number;
  field_of_view_deg: [number, number];
  rectified_focal_px: number;
  rectified_baseline_mm: number;
  timing: string;
  notes: string[];
  live: boolean;
  /** Live, and gives no pictures at the moment. */
  silent: boolean;
  /** Another one for each picture that is looked at. */
  picture: number;
}

/** What is kept of a live source. */
export interface KeptState {
  folder: string;
  frames: number;
  seconds: number;
  left_out: number;
  over: boolean;
  end: string;
}

export interface MapState {
  frame: number;
  number: number;
  stale: boolean;
  counts: {matched_points: number; nodes: number; elements: number; fixed_nodes: number; surface_triangles: number};
  coverage: number;
  median_depth_deviation_mm: number;
  smallest_dihedral_deg: number;
  row_offset_px: number;
  warnings?: string[];
  labels?: {label: number; elements: number; young_modulus_kPa: number}[];
}

export interface RunState {
  folder: string;
  frames: number;
  frame?: number;
  over: boolean;
  end: string;
  passed_over: number;
  /** Frames of a live source in whose place a newer one was looked at. */
  dropped: number;
  /** From the stamp of its source until both pictures of the frame were there. */
  waited_ms?: number;
  marks: [number, number, string][];
  tip_mm?: [number, number, number];
  times_ms?: {[stage: string]: number};
  answer_ms?: number;
  warnings?: string[];
}

/** One row of forces.csv. */
export interface Row {
  frame: number;
  time_s: number;
  status: string;
  in_contact: number;
  force_N: [number, number, number];
  magnitude_N: number;
  low_N: number;
  high_N: number;
  tip_mm: [number, number, number];
  stress_kPa: number;
  frame_ms: number;
  warnings: string;
  grip: string;
  p_contact: number;
  footprint_mm: number;
}

/** False where the next frame was there before this one could be looked at. */
export function wasLookedAt(row: Row): boolean {
  return !row.warnings.includes('frame_passed_over');
}

type RawRow = [number, number, string, number, number, number, number, number, number, number, number, number, number,
  number, number, string, string, number, number];

export function rowOf(raw: unknown): Row {
  const r = raw as RawRow;
  return {
    frame: r[0], time_s: r[1], status: r[2], in_contact: r[3], force_N: [r[4], r[5], r[6]], magnitude_N: r[7],
    low_N: r[8], high_N: r[9], tip_mm: [r[10], r[11], r[12]], stress_kPa: r[13], frame_ms: r[14], warnings: r[15],
    grip: r[16], p_contact: r[17], footprint_mm: r[18],
  };
}

export interface KeyRow {
  key: string;
  default: string;
  values: string;
  meaning: string;
}
