/** Values of the scene file as the page edits them: YAML on one line. */
import type {KeyRow, Yaml} from './types';

export type Point = [number, number];

export interface Change {
  path: string[];
  value: string;
}

export function at(values: Yaml | undefined, path: string[]): Yaml | undefined {
  let now: Yaml | undefined = values;
  for (const name of path) {
    if (now === undefined || typeof now === 'string') return undefined;
    now = Array.isArray(now) ? now[Number(name)] : now[name];
  }
  return now;
}

export function pointsOf(value: Yaml | undefined): Point[] {
  if (!Array.isArray(value)) return [];
  if (value.length === 2 && typeof value[0] === 'string') return [[Number(value[0]), Number(value[1])]];
  return value.flatMap((point) => (Array.isArray(point) ? [[Number(point[0]), Number(point[1])] as Point] : []));
}

const round = (value: number) => Math.round(value * 10) / 10;

export function yamlOfPoints(points: Point[]): string {
  return `[${points.map(([x, y]) => `[${round(x)}, ${round(y)}]`).join(', ')}]`;
}

/** As it may stand in a file; words with spaces or signs in quotes. */
export function yamlOfText(text: string): string {
  const trimmed = text.trim();
  if (trimmed === '' || /^[[{]/.test(trimmed) || /^[\w./+-]+$/.test(trimmed)) return trimmed;
  return JSON.stringify(trimmed);
}

export function textOf(value: Yaml | undefined): string {
  if (value === undefined) return '';
  if (typeof value === 'string') return value;
  if (Array.isArray(value)) return `[${value.map(textOf).join(', ')}]`;
  return `{${Object.entries(value).map(([key, inner]) => `${key}: ${textOf(inner)}`).join(', ')}}`;
}

/** The same for reading: numbers with three digits. */
export function shortTextOf(value: Yaml | undefined): string {
  return textOf(value).replace(/-?\d+\.\d{3,}(e[+-]?\d+)?/g, (number) => String(Number(Number(number).toPrecision(3))));
}

/** The unit that stands at the end of a key. */
export function unitOf(key: string): string {
  const units: {[ending: string]: string} = {mm: 'mm', kPa: 'kPa', px: 'px', s: 's', ms: 'ms', deg: '°', hz: 'Hz', N: 'N'};
  return units[key.split('_').at(-1) ?? ''] ?? '';
}

export function wordsOf(row: KeyRow): string[] {
  return /^[\w.-]+(, [\w.-]+)+$/.test(row.values) ? row.values.split(', ') : [];
}

export interface Preset {
  name: string;
  young_modulus_kPa: string;
  poisson_ratio: string;
  source: string;
}

/** "liver (27 kPa, 0.45; its source); ..." as the key tissue.preset tells it. */
export function presetsOf(row: KeyRow | undefined): Preset[] {
  return [...(row?.meaning ?? '').matchAll(/([\w-]+) \(([\d.]+) kPa, ([\d.]+); ([^)]*)\)/g)].map((found) => ({
    name: found[1]!, young_modulus_kPa: found[2]!, poisson_ratio: found[3]!, source: found[4]!,
  }));
}

/** A line drawn by hand as corners: those left out lie nearer than `near` to the line. */
export function simplified(points: Point[], near: number): Point[] {
  if (points.length < 4) return points;
  const [first, last] = [points[0]!, points.at(-1)!];
  const length = Math.hypot(last[0] - first[0], last[1] - first[1]);
  let farthest = 0, index = 0;
  points.forEach(([x, y], i) => {
    const away = length > 1e-9
      ? Math.abs((last[0] - first[0]) * (first[1] - y) - (first[0] - x) * (last[1] - first[1])) / length
      : Math.hypot(x - first[0], y - first[1]);
    if (away > farthest) [farthest, index] = [away, i];
  });
  if (farthest <= near) return [first, last];
  return [...simplified(points.slice(0, index + 1), near).slice(0, -1), ...simplified(points.slice(index), near)];
}
