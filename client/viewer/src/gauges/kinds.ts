// Kinds of gauges and their text form, as in core/GAUGES.md.
import { LEAST_LENGTH, MOST_OF_PLANES, parseDecimal } from '../input/number_text';

interface Kind {
  numbers: readonly string[];
  values: readonly string[];
  /** Number of values, from the first on, that a curve shows. */
  drawn: number;
}

/** All kinds except `packing`: it requires areas of particles, which the page does not have. */
export const KINDS = {
  height: { numbers: ['x'], values: ['highest', 'lowest', 'crossings'], drawn: 2 },
  front: { numbers: ['dx', 'dy'], values: ['position', 'x', 'y'], drawn: 1 },
  wetted: { numbers: ['x0', 'y0', 'x1', 'y1'], values: ['length'], drawn: 1 },
  box: { numbers: ['min_x', 'min_y', 'max_x', 'max_y'], values: ['area', 'x', 'y'], drawn: 1 },
  contact: {
    numbers: ['x', 'y', 'dx', 'dy', 'reach'], values: ['start_angle', 'end_angle', 'start', 'end'], drawn: 2,
  },
  repose: { numbers: [], values: ['left_angle', 'right_angle'], drawn: 2 },
} as const satisfies Record<string, Kind>;

export type KindName = keyof typeof KINDS;

/** A measurement of an outline. Lengths in world units. */
export interface Gauge { name: string; kind: KindName; numbers: readonly number[] }

export const kindOf = ({ kind }: Gauge): Kind => KINDS[kind];

/** Names of the columns of a gauge: NAME_VALUE, or NAME if it has one value. */
export function columnsOf(gauge: Gauge): string[] {
  const { values } = kindOf(gauge);
  return values.length === 1 ? [gauge.name] : values.map((value) => `${gauge.name}_${value}`);
}

/** Parses `level=height:0.5`. Throws an Error that names the rule. */
export function parseGauge(text: string): Gauge {
  const [, name, kind, rest] = /^([^=]*)=([^:]*)(?::(.*))?$/.exec(text) ?? [];
  if (name === undefined) throw new Error('A gauge has the form NAME=KIND:NUMBERS, such as level=height:0.5.');
  if (!/^\w{1,40}$/.test(name)) throw new Error('The name must have 1 to 40 of letters, digits and _.');
  if (!Object.hasOwn(KINDS, kind)) throw new Error(`The kind must be one of ${Object.keys(KINDS).join(', ')}.`);
  const gauge = { name, kind: kind as KindName, numbers: (rest === undefined ? [] : rest.split(',')).map(parseDecimal) };
  const wanted = kindOf(gauge).numbers;
  if (gauge.numbers.length !== wanted.length || !gauge.numbers.every((value) => Math.abs(value) <= MOST_OF_PLANES)) {
    throw new Error(wanted.length === 0 ? `${kind} has no numbers.` : `${kind} must have the numbers ${wanted.join(',')}.`);
  }
  checkShape(gauge);
  return gauge;
}

const isShort = (x: number, y: number) => !(Math.sqrt(x * x + y * y) >= LEAST_LENGTH);

function checkShape({ kind, numbers: [a, b, c, d, reach] }: Gauge): void {
  if (kind === 'front' && isShort(a, b)) throw new Error('The direction must not be zero.');
  if (kind === 'wetted' && isShort(c - a, d - b)) throw new Error('The ends must differ.');
  if (kind === 'box' && !(a < c && b < d)) throw new Error('max_x and max_y must be above min_x and min_y.');
  if (kind === 'contact' && isShort(c, d)) throw new Error('The direction must not be zero.');
  if (kind === 'contact' && !(reach > 0)) throw new Error('reach must be above 0.');
}
