// What the columns of a table mean, by their names: as client/input/base/columns.h has it.
import { InputError } from './source';

export interface ColumnPlan {
  /** Index of the columns of x, y, z; null for an axis that the table lacks. */
  positions: (number | null)[];
  velocities: (number | null)[];
  id: number | null;
  volume: number | null;
  /** Everything else that may be numbers. */
  scalars: { name: string; column: number }[];
  /** Positions are LAMMPS's xs ys zs: fractions of the box. */
  scaled: boolean;
}

const AXES = ['x', 'y', 'z'];
const VECTORS = ['pos', 'position', 'positions', 'point', 'points', 'coord', 'coords',
  'coordinate', 'coordinates', 'xy', 'xyz'];
const VELOCITIES = ['v', 'vel', 'velocity', 'velocities'];
const IDS = ['id', 'ids', 'idp', 'particleid', 'particleids', 'originalid', 'pid', 'gid', 'tag'];
const VOLUMES = ['volume', 'volumes', 'vol', 'area', 'areas', 'particlevolume', 'particlearea',
  'volumetricmeasure'];
/** More scalars than anybody chooses from cost more than they tell. */
const MOST_SCALARS = 8;

/** "Pos.x [m]" -> "posx": what is left of a name when people's habits are taken away. */
function canonical(name: string): string {
  const unit = name.search(/[[(]/);
  return (unit > 0 ? name.slice(0, unit) : name).toLowerCase().replace(/[ _.:\-"']/g, '');
}

function spellings(stems: string[], axis: number): string[] {
  return stems.flatMap((stem) => [stem + AXES[axis], `${stem}${axis}`, AXES[axis] + stem]);
}

function find(names: string[], wanted: string[]): number | null {
  for (const name of wanted) {
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

/** A plan for a table that names its columns. Throws InputError where there are no positions. */
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
    `No columns of positions among ${given.slice(0, 12).join(', ')}. Name them x and y.`);
}

/** A plan for a table of `count` columns without names: two are x y, three are x y z. */
export function planUnnamedColumns(count: number): ColumnPlan {
  if (count !== 2 && count !== 3) {
    throw new InputError(`${count} columns without names. Write a first line that names them, ` +
                         'with x and y among them.');
  }
  return {
    positions: [0, 1, count === 3 ? 2 : null], velocities: [null, null, null], id: null,
    volume: null, scalars: [], scaled: false,
  };
}
