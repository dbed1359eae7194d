// Recognises table columns by their names, with the rules of client/input/base/columns.h.
import { ALL_COLUMNS, type ColumnRequest, type Condition, FieldError } from './options';

export interface ColumnPlan {
  /** Columns of x, y, z; null for a missing axis. */
  positions: (number | null)[];
  velocities: (number | null)[];
  id: number | null;
  volume: number | null;
  /** The first MOST_SCALARS other columns with a name that the server accepts; of equal names the first. */
  scalars: { name: string; column: number }[];
  /** Positions are fractions of the box (LAMMPS xs, ys, zs). */
  scaled: boolean;
  /** Columns ix iy iz of LAMMPS: how often the particle has crossed the periodic box along each axis. */
  images: (number | null)[];
  /** The conditions of the request, with the columns that they name. */
  conditions: { column: number; condition: Condition }[];
}

const AXES = ['x', 'y', 'z'];
const VECTORS = ['pos', 'position', 'positions', 'point', 'points', 'coord', 'coords',
  'coordinate', 'coordinates', 'xy', 'xyz'];
const VELOCITIES = ['v', 'vel', 'velocity', 'velocities'];
const IDS = ['id', 'ids', 'idp', 'particleid', 'particleids', 'originalid', 'pid', 'gid', 'tag'];
const VOLUMES = ['volume', 'volumes', 'vol', 'area', 'areas', 'particlevolume', 'particlearea',
  'volumetricmeasure'];
/** Limit of scalars in a frame, because every scalar is sent to the server. */
export const MOST_SCALARS = 8;
/** Names that the server accepts for scalars (core/src/frame/frame_attributes.cc). Columns with other names are not sent. */
export const SCALAR_NAME = /^[ -~]{1,64}$/;

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
/** Families (indices) that image flags unwrap: x and xs. Positions that the request names are not unwrapped. */
const WRAPPED_FAMILIES = [0, 3];

/** Number of axes with a column. */
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

const list = (names: string[]) => names.slice(0, 12).join(', ') + (names.length > 12 ? ', …' : '');

/** Finds a column by its exact name, by its number from 1, or by another spelling. */
function findAsked(given: string[], names: string[], asked: string): number | null {
  const exact = given.indexOf(asked);
  if (exact >= 0) return exact;
  if (/^[1-9]\d*$/.test(asked) && Number(asked) <= given.length) return Number(asked) - 1;
  return find(names, [canonical(asked)]);
}

type PositionPlan = Pick<ColumnPlan, 'positions' | 'scaled' | 'images'> & { isKnown: boolean };

const NO_IMAGES = [null, null, null];

function recognisedPositions(names: string[], given: string[]): PositionPlan {
  for (const [k, family] of FAMILIES.entries()) {
    const positions = AXES.map((_, axis) => find(names, family(axis)));
    if (found(positions) < 2) continue;
    const images = WRAPPED_FAMILIES.includes(k) ? AXES.map((axis) => find(names, [`i${axis}`])) : NO_IMAGES;
    return { positions, scaled: k >= FIRST_SCALED_FAMILY, images, isKnown: true };
  }
  throw new FieldError('columns', `No position columns in ${list(given)}. Name the columns of x and y.`);
}

/** The columns of the request. Their axes follow from their names if these are in rising order (x, z); else x, y, z. */
function askedPositions(names: string[], given: string[], asked: readonly string[]): PositionPlan {
  if (asked.length !== 2 && asked.length !== 3) {
    throw new FieldError('columns', `Name two or three columns, not ${asked.length}.`);
  }
  const columns = asked.map((name) => {
    const column = findAsked(given, names, name);
    if (column === null) throw new FieldError('columns', `There is no column '${name}'. The columns are ${list(given)}.`);
    return column;
  });
  for (const [k, family] of FAMILIES.entries()) {
    const positions: (number | null)[] = [null, null, null];
    let next = 0;
    for (let axis = 0; axis < 3 && next < columns.length; ++axis) {
      if (find(names, family(axis)) === columns[next]) positions[axis] = columns[next++];
    }
    if (next === columns.length) return { positions, scaled: k >= FIRST_SCALED_FAMILY, images: NO_IMAGES, isKnown: true };
  }
  return { positions: AXES.map((_, axis) => columns[axis] ?? null), scaled: false, images: NO_IMAGES, isKnown: false };
}

/** Plans a table with named columns. Throws FieldError. */
export function planNamedColumns(given: string[], request: ColumnRequest = ALL_COLUMNS): ColumnPlan {
  const names = given.map(canonical);
  const { positions, scaled, images, isKnown } = request.columns.length > 0
    ? askedPositions(names, given, request.columns) : recognisedPositions(names, given);
  const velocities = isKnown ? planVelocities(names) : [null, null, null];
  const id = find(names, IDS);
  const volume = find(names, VOLUMES);
  const used = new Set([...positions, ...velocities, id, volume]);
  const scalars = given.map((name, column) => ({ name, column }))
    .filter(({ name, column }) => !used.has(column) && SCALAR_NAME.test(name))
    .filter(({ name }, k, all) => all.findIndex((other) => other.name === name) === k).slice(0, MOST_SCALARS);
  const conditions = request.conditions.map((condition) => {
    const column = findAsked(given, names, condition.column);
    if (column === null) {
      throw new FieldError('select', `There is no column '${condition.column}'. The columns are ${list(given)}.`);
    }
    return { column, condition };
  });
  return { positions, velocities, id, volume, scalars, scaled, images, conditions };
}

/**
 * Names for the columns of a table without names: x y or x y z if the request names none. If it has
 * numbers (2,3), the names are 1, 2, 3, ... If it has names (id,x,y), these are of the first columns.
 * Throws FieldError.
 */
export function namesOfUnnamed(count: number, request: ColumnRequest): { names: string[]; request: ColumnRequest } {
  const { columns } = request;
  if (columns.length === 0) {
    if (count !== 2 && count !== 3) {
      throw new FieldError('columns', `The file has ${count} columns without names. Write the numbers of the ` +
        'position columns (2,3), or the names of all columns (id,x,y).');
    }
    return { names: AXES.slice(0, count), request };
  }
  if (columns.every((name) => /^\d+$/.test(name))) {
    return { names: Array.from({ length: count }, (_, k) => String(k + 1)), request };
  }
  if (columns.length > count) {
    throw new FieldError('columns', `${columns.length} names for the ${count} columns of the file.`);
  }
  const names = Array.from({ length: count }, (_, k) => columns[k] ?? '-');
  return { names, request: { ...request, columns: [] } };
}

/** Plans a table. Without `names`, as namesOfUnnamed. Throws FieldError. */
export function planColumns(names: string[], count: number, request: ColumnRequest): ColumnPlan {
  if (names.length > 0) return planNamedColumns(names, request);
  const named = namesOfUnnamed(count, request);
  return planNamedColumns(named.names, named.request);
}
