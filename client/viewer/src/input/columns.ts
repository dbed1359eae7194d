// Recognises table columns by their names, with the rules of client/input/base/columns.h.
import { InputError } from './source';

export interface ColumnPlan {
  /** Columns of x, y, z; null for a missing axis. */
  positions: (number | null)[];
  velocities: (number | null)[];
  id: number | null;
  volume: number | null;
  /** All other columns. */
  scalars: { name: string; column: number }[];
  /** Positions are fractions of the box (LAMMPS xs, ys, zs). */
  scaled: boolean;
}

const AXES = ['x', 'y', 'z'];
const VECTORS = ['pos', 'position', 'positions', 'point', 'points', 'coord', 'coords',
  'coordinate', 'coordinates', 'xy', 'xyz'];
const VELOCITIES = ['v', 'vel', 'velocity', 'velocities'];
const IDS = ['id', 'ids', 'idp', 'particleid', 'particleids', 'originalid', 'pid', 'gid', 'tag'];
const VOLUMES = ['volume', 'volumes', 'vol', 'area', 'areas', 'particlevolume', 'particlearea',
  'volumetricmeasure'];
/** Limit, because every scalar is sent to the server. */
const MOST_SCALARS = 8;

/** Removes units, separators and case from a name: "Pos.x [m]" -> "posx". */
function canonical(name: string): string {
  const unit = name.search(/[[(]/);
  return (unit > 0 ? name.slice(0, unit) : name).toLowerCase().replace(/[ _.:\-"']/g, '');
}

function spellings(stems: string[], axis: number): string[] {
  return stems.flatMap((stem) => [stem + AXES[axis], `${stem}${axis}`, AXES[axis] + stem]);
}

function find(names: string[], candidates: string[]): number | null {
  for (const name of candidates) {
    const at = names.indexOf(name);
    if (at >= 0) return at;
  }
  return null;
}

/** Families of position columns in the order of preference. */
const FAMILIES: ((axis: number) => string[])[] = [
  (axis) => [AXES[axis]],
  (axis) => spellings(VECTORS, axis),
  (axis) => [`${AXES[axis]}u`],
  (axis) => [`${AXES[axis]}s`],
  (axis) => [`${AXES[axis]}su`],
];
const FIRST_SCALED_FAMILY = 3;

function found(axes: (number | null)[]): number {
  return axes.filter((axis) => axis !== null).length;
}

function planVelocities(names: string[]): (number | null)[] {
  const axes = AXES.map((_, axis) => find(names, spellings(VELOCITIES, axis)));
  if (found(axes) > 0) return axes;
  const u = names.indexOf('u');
  const v = names.indexOf('v');
  return u >= 0 && v >= 0 ? [u, v, find(names, ['w'])] : axes;  // PySPH's names.
}

/** Plans a table with named columns. Throws InputError if there are no positions. */
export function planNamedColumns(given: string[]): ColumnPlan {
  const names = given.map(canonical);
  for (const [k, family] of FAMILIES.entries()) {
    const positions = AXES.map((_, axis) => find(names, family(axis)));
    if (found(positions) < 2) continue;
    const velocities = planVelocities(names);
    const id = find(names, IDS);
    const volume = find(names, VOLUMES);
    const used = new Set([...positions, ...velocities, id, volume]);
    const scalars = given.map((name, column) => ({ name, column }))
      .filter(({ column }) => !used.has(column)).slice(0, MOST_SCALARS);
    return { positions, velocities, id, volume, scalars, scaled: k >= FIRST_SCALED_FAMILY };
  }
  throw new InputError(
    `No position columns in ${given.slice(0, 12).join(', ')}. Name them x and y.`);
}

/** Plans a table without names: two columns are x y, three are x y z. */
export function planUnnamedColumns(count: number): ColumnPlan {
  if (count !== 2 && count !== 3) {
    throw new InputError(
      `${count} columns without names. Add a first line with names, including x and y.`);
  }
  return {
    positions: [0, 1, count === 3 ? 2 : null], velocities: [null, null, null], id: null,
    volume: null, scalars: [], scaled: false,
  };
}
