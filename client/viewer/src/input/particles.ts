import { PositionFormat } from '@proto/v1/reconstruction_pb';
import { bytesOf } from '../protocol/arrays';
import type { Particles } from '../protocol/particles';
import type { ColumnPlan } from './columns';
import { InputError } from './source';

/** Relative extent above which an axis counts. Above the rounding of six-digit text. */
const FLAT = 1e-6;

/** The two axes of the particles' plane. Throws InputError for 3D particles. */
function planeOf(axes: (Float64Array | null)[], name: string): [number, number] {
  const there = axes.flatMap((axis, k) => axis ? [k] : []);
  if (there.length === 2) return [there[0], there[1]];
  const extents = axes.map((axis) => extentOf(axis as Float64Array));
  const largest = Math.max(...extents);
  for (let axis = 2; axis >= 0; --axis) {
    if (extents[axis] > FLAT * largest) continue;
    return axis === 0 ? [1, 2] : [0, axis === 1 ? 2 : 1];
  }
  const text = extents.map((extent) => extent.toPrecision(3)).join(' x ');
  throw new InputError(`${name} is 3D (extents ${text}). The page reads 2D data only. Extract a slice first.`);
}

function extentOf(values: Float64Array): number {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return high >= low ? high - low : 0;
}

function column(rows: string[][], at: number, name: string): Float64Array {
  const values = new Float64Array(rows.length);
  rows.forEach((cells, i) => {
    const value = Number(cells[at]);
    if (Number.isNaN(value) && !/^[+-]?nan$/i.test(cells[at])) {
      throw new InputError(`${name}, row ${i + 1}: '${cells[at]}' is not a number.`);
    }
    values[i] = value;
  });
  return values;
}

function interleaved<T extends Float32Array | Float64Array>(x: Float64Array, y: Float64Array,
                                                            out: T): T {
  for (let i = 0; i < x.length; ++i) {
    out[2 * i] = x[i];
    out[2 * i + 1] = y[i];
  }
  return out;
}

/** Ids; null if one is invalid or a duplicate. */
function idsOf(rows: string[][], at: number): BigUint64Array | null {
  const ids = new BigUint64Array(rows.length);
  const seen = new Set<bigint>();
  for (const [i, cells] of rows.entries()) {
    if (!/^\d+(\.0*)?$/.test(cells[at])) return null;
    ids[i] = BigInt(cells[at].split('.')[0]);
    seen.add(ids[i]);
  }
  return seen.size === rows.length ? ids : null;
}

/** A column as float32; null if a value is not finite, or not positive if `positive` is set. */
function floatsOf(rows: string[][], at: number, positive: boolean): Float32Array | null {
  const values = new Float32Array(rows.length);
  for (const [i, cells] of rows.entries()) {
    values[i] = Number(cells[at]);
    if (!Number.isFinite(values[i]) || (positive && !(values[i] > 0))) return null;
  }
  return values;
}

/** Converts fractions of a box to coordinates, in place. */
export type Unscale = (axes: (Float64Array | null)[]) => void;

/** Converts table rows to a frame. Without a time, uses `index` and drops velocities. */
export function particlesOf(rows: string[][], plan: ColumnPlan, time: number | null, index: number,
                            name: string, unscale?: Unscale): Particles {
  const axes = plan.positions.map((at) => at === null ? null : column(rows, at, name));
  unscale?.(axes);
  const [first, second] = planeOf(axes, name);
  const positions = interleaved(axes[first] as Float64Array, axes[second] as Float64Array,
                                new Float64Array(2 * rows.length));
  const frame: Particles = {
    time: time ?? index,
    positionFormat: PositionFormat.FLOAT64_2,
    positions: bytesOf(positions),
    scalars: [],
  };
  const ids = plan.id === null ? null : idsOf(rows, plan.id);
  if (ids) frame.ids = bytesOf(ids);
  const volumes = plan.volume === null ? null : floatsOf(rows, plan.volume, true);
  if (volumes) frame.volumes = bytesOf(volumes);
  const vx = plan.velocities[first];
  const vy = plan.velocities[second];
  if (time !== null && vx !== null && vy !== null) {
    const velocities = interleaved(column(rows, vx, name), column(rows, vy, name),
                                   new Float32Array(2 * rows.length));
    if (velocities.every(Number.isFinite)) frame.velocities = bytesOf(velocities);
  }
  for (const scalar of plan.scalars) {
    const values = floatsOf(rows, scalar.column, false);
    if (values) frame.scalars?.push({ name: scalar.name, values: bytesOf(values) });
  }
  return frame;
}
