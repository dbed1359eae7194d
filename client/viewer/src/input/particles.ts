import { PositionFormat } from '@proto/v1/reconstruction_pb';
import { bytesOf } from '../protocol/arrays';
import type { Particles } from '../protocol/particles';
import type { ColumnPlan } from './columns';
import { CHOOSE_SPACE, FieldError, NOT_IN_SPACE } from './options';
import { boxAlong, type RecordedBox } from './periodic';
import type { Rows } from './rows';

/** An axis with an extent up to this share of the largest one is flat. The share allows for text of six digits. */
const FLAT = 1e-6;

type Axes = (Float64Array | null)[];

/** Whether the particles fill three dimensions. */
export function isInSpace(axes: Axes): boolean {
  return axes.every((axis) => axis !== null) && flatAxis(axes) === null;
}

/** The axis along which particles with three coordinates have no extent; null without one. */
function flatAxis(axes: Axes): number | null {
  const extents = axes.map((axis) => extentOf(axis as Float64Array));
  const largest = Math.max(...extents);
  for (let axis = 2; axis >= 0; --axis) {
    if (extents[axis] <= FLAT * largest) return axis;
  }
  return null;
}

/** The two axes of the particles' plane. Throws FieldError for 3D particles. */
function planeOf(axes: Axes, name: string): [number, number] {
  const there = axes.flatMap((axis, k) => axis ? [k] : []);
  if (there.length === 2) return [there[0], there[1]];
  const axis = flatAxis(axes);
  if (axis !== null) return axis === 0 ? [1, 2] : [0, axis === 1 ? 2 : 1];
  const text = axes.map((values) => extentOf(values as Float64Array).toPrecision(3)).join(' x ');
  throw new FieldError('slice', `${name} is 3D (extents ${text}). ${CHOOSE_SPACE}`);
}

export function extentOf(values: Float64Array): number {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return high >= low ? high - low : 0;
}

function interleaved<T extends Float32Array | Float64Array>(parts: Float64Array[], out: T): T {
  parts.forEach((part, k) => {
    for (let i = 0; i < part.length; ++i) out[parts.length * i + k] = part[i];
  });
  return out;
}

/** A column as float32; null if a value is not finite, or not positive if `positive` is set. */
function floatsOf(rows: Rows, at: number, positive: boolean): Float32Array | null {
  const values = Float32Array.from(rows.values(at));
  return values.every((value) => Number.isFinite(value) && (!positive || value > 0)) ? values : null;
}

/** Ids; null if one is invalid or a duplicate. */
function idsOf(rows: Rows, at: number): BigUint64Array | null {
  const ids = rows.ids(at);
  return ids && new Set(ids).size === rows.count ? ids : null;
}

/** In place: converts fractions of the box to positions if `scaled`, and adds `images` times the edges of the box. */
export type Place = (axes: Axes, images: Axes, scaled: boolean) => void;

/** The particles of a frame. */
export interface ParticleTable {
  rows: Rows;
  /** Null: unknown. The particles then have no velocities, and their time is `step`, or `index` without a step. */
  time: number | null;
  /** Number of the time step. */
  step?: number;
  index: number;
  /** For errors. */
  name: string;
  place?: Place;
  box?: RecordedBox;
}

/** The coordinates of the particles, by axis. */
export function positionsOf({ rows, place }: ParticleTable, plan: ColumnPlan): Axes {
  const numbersOf = (columns: (number | null)[]) => columns.map((at) => at === null ? null : rows.numbers(at));
  const axes = numbersOf(plan.positions);
  place?.(axes, numbersOf(plan.images), plan.scaled);
  return axes;
}

/**
 * Converts table rows to a frame. `inSpace`: keeps three coordinates. `periodic`: axes of its box. Leaves out ids,
 * volumes, velocities and scalars with an invalid value. Throws InputError.
 */
export function particlesOf(table: ParticleTable, plan: ColumnPlan, inSpace: boolean, periodic: readonly number[]): Particles {
  const rows = table.rows.where(plan.conditions);
  const { time, step, index, name, box } = table;
  const axes = positionsOf({ ...table, rows }, plan);
  if (inSpace && axes.some((axis) => axis === null)) {
    throw new FieldError('slice', `${name} ${NOT_IN_SPACE}`);
  }
  const chosen = inSpace ? [0, 1, 2] : planeOf(axes, name);
  const components = chosen.length;
  const positions = interleaved(chosen.map((axis) => axes[axis] as Float64Array),
                                new Float64Array(components * rows.count));
  const frame: Particles = {
    time: time ?? step ?? index,
    positionFormat: inSpace ? PositionFormat.FLOAT64_3 : PositionFormat.FLOAT64_2,
    positions: bytesOf(positions),
    scalars: [],
  };
  if (periodic.length > 0) {
    frame.box = boxAlong(periodic, box && { ...box, axes: chosen.map((axis) => box.axes[axis]) }, name);
  }
  const ids = plan.id === null ? null : idsOf(rows, plan.id);
  if (ids) frame.ids = bytesOf(ids);
  const volumes = plan.volume === null ? null : floatsOf(rows, plan.volume, true);
  if (volumes) frame.volumes = bytesOf(volumes);
  const moving = chosen.map((axis) => plan.velocities[axis]);
  if (time !== null && moving.every((at) => at !== null)) {
    const velocities = interleaved(moving.map((at) => rows.numbers(at)), new Float32Array(components * rows.count));
    if (velocities.every(Number.isFinite)) frame.velocities = bytesOf(velocities);
  }
  for (const scalar of plan.scalars) {
    const values = floatsOf(rows, scalar.column, false);
    if (values) frame.scalars?.push({ name: scalar.name, values: bytesOf(values) });
  }
  return frame;
}
