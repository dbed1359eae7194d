// The options of opening files: the same texts as the options of `partiemc replay`.
import type { SectionPlane } from '../protocol/sections';
import { LEAST_LENGTH, MOST_OF_PLANES, MOST_OF_WALLS, parseDecimal } from './number_text';
import { InputError } from './source';

export const FILE_FIELDS = ['spacing', 'columns', 'select', 'slice', 'periodic'] as const;
export type FileField = typeof FILE_FIELDS[number];

/** Empty: the default. */
export type FileOptions = Record<FileField, string>;

export const NO_OPTIONS: Readonly<FileOptions> = { spacing: '', columns: '', select: '', slice: '', periodic: '' };

/** Facts of files, which are the defaults of their options. */
export interface FileFacts {
  /** World units: of the recording, or estimated for 3D particles. Empty: the server estimates it. */
  spacing: string;
  /** Columns that hold the positions, separated by commas. Empty: they are not recognised. */
  columns: string;
  /** Names of all columns. Empty: a recording. */
  names: string[];
  /** Filters that keep a part of the particles, such as `type=1`. */
  filters: string[];
  /** A plane through the middle of 3D particles. Empty: the particles are 2D. */
  slice: string;
  /** Whether the first frame has a box with a periodic boundary. */
  hasBox: boolean;
}

/** Error of one option. */
export class FieldError extends InputError {
  constructor(readonly field: FileField, message: string) { super(message); }
}

/** A condition on a column. `number`: NaN if the text is no number. */
export interface Condition { column: string; text: string; number: number }

/** The options that choose columns and rows. */
export interface ColumnRequest { columns: readonly string[]; conditions: readonly Condition[] }

export const ALL_COLUMNS: ColumnRequest = { columns: [], conditions: [] };

/** Parses the columns `x,y` and the filter `type=1`, of which there can be several. Throws FieldError. */
export function parseRequest({ columns, select }: FileOptions): ColumnRequest {
  return {
    columns: listOf(columns).map((name) => {
      if (name === '') throw new FieldError('columns', 'Write names or numbers of columns, for example x,y or 2,3.');
      return name;
    }),
    conditions: listOf(select).map((text) => {
      const at = text.indexOf('=');
      const [column, value] = [text.slice(0, at).trim(), text.slice(at + 1).trim()];
      if (at < 1 || column === '' || value === '') {
        throw new FieldError('select', 'Write a column and its value, for example type=1.');
      }
      return { column, text: value, number: parseDecimal(value.replace(/^\+(?!-)/, '')) };
    }),
  };
}

function listOf(text: string): string[] {
  return text.trim() === '' ? [] : text.split(',').map((part) => part.trim());
}

/** A length in world units; null for the default. Throws FieldError. */
export function parseSpacing(text: string): number | null {
  if (text.trim() === '') return null;
  const value = parseDecimal(text);
  if (!(value >= LEAST_LENGTH && value <= MOST_OF_WALLS)) {
    throw new FieldError('spacing', 'The spacing must be a positive length, for example 0.02.');
  }
  return value;
}

/** Errors of the option `slice`, after the name of the file. */
export const CHOOSE_SPACE = 'Choose the plane that cuts it, for example z=0, or open it as a surface.';
export const NOT_IN_SPACE = 'has two coordinates. Planes and surfaces are of particles with x, y and z only.';

/** The word for surfaces in the option `slice`. */
export const SURFACE = 'surface';

/** How 3D particles are reconstructed: as surfaces, or as the outline in the first plane. Other planes are sections. */
export interface SpaceChoice { isSurface: boolean; slices: readonly SectionPlane[] }

/** Planes `z=0.5` or `OX,OY,OZ,NX,NY,NZ`, and `surface`, separated by semicolons. Throws FieldError. */
export function parseSlices(text: string): SpaceChoice {
  const parts = text.split(';').map((part) => part.trim()).filter(Boolean);
  const slices = parts.filter((part) => part !== SURFACE).map((part) => {
    const plane = planeOf(part);
    if (plane) return plane;
    throw new FieldError('slice', 'Write a plane as x=C, y=C, z=C, or as a point and a normal OX,OY,OZ,NX,NY,NZ; or the word surface.');
  });
  return { isSurface: parts.includes(SURFACE), slices };
}

/** Throws FieldError if surfaces or planes are chosen without a spacing. */
export function checkSpacing({ isSurface, slices }: SpaceChoice, spacing: number | null): void {
  if (spacing !== null || (!isSurface && slices.length === 0)) return;
  throw new FieldError('spacing', isSurface ? 'Surfaces need the spacing of the particles.'
    : 'Particles in a plane of 3D need their spacing.');
}

function planeOf(text: string): SectionPlane | null {
  const [, axis, at] = /^([xyz])=(.*)$/.exec(text) ?? [];
  if (axis) {
    const k = 'xyz'.indexOf(axis);
    const place = [0, 0, 0];
    place[k] = parseDecimal(at);
    // With this sign of the normal, the picture has the two other axes in alphabetical order.
    const normal = [0, 0, 0];
    normal[k] = axis === 'y' ? -1 : 1;
    return isOfPlanes(place[k]) ? { origin: triple(place), normal: triple(normal) } : null;
  }
  const numbers = text.split(',').map(parseDecimal);
  const isPlane = numbers.length === 6 && numbers.every(isOfPlanes) &&
    numbers.slice(3).some((part) => Math.abs(part) >= LEAST_LENGTH);
  return isPlane ? { origin: triple(numbers), normal: triple(numbers.slice(3)) } : null;
}

function isOfPlanes(value: number): boolean {
  return Math.abs(value) <= MOST_OF_PLANES;
}

function triple([x, y, z]: number[]): [number, number, number] {
  return [x, y, z];
}

/** Options in the page's address: `spacing:0.02;slice:z=0.5`. Semicolons of planes become `|`. */
export function optionsText(options: FileOptions): string {
  return FILE_FIELDS.filter((field) => options[field] !== '')
    .map((field) => `${field}:${options[field].replaceAll(';', '|')}`).join(';');
}

/** The inverse of optionsText. Ignores unknown names. */
export function parseOptions(text: string): FileOptions {
  const options = { ...NO_OPTIONS };
  for (const part of text.split(';')) {
    const at = part.indexOf(':');
    const field = FILE_FIELDS.find((name) => name === part.slice(0, at));
    if (field) options[field] = part.slice(at + 1).replaceAll('|', ';');
  }
  return options;
}
