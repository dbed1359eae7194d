// Arrays of VTK files as the table of a frame.
import { columnsOf, MOST_COMPONENTS, type NamedColumns } from './npy';
import { NumberRows } from './rows';
import { InputError } from './source';
import type { FrameTable } from './table_source';

/** Types of VTK by the codes of NumPy. */
export const VTK_TYPES: Record<string, string> = {
  Float32: 'f4', Float64: 'f8', Int8: 'i1', UInt8: 'u1', Int16: 'i2', UInt16: 'u2', Int32: 'i4', UInt32: 'u4',
  Int64: 'i8', UInt64: 'u8',
};

/** An array with one or more numbers per row. `type`: a code of NumPy. */
export interface VtkArray { name: string; components: number; type: string; little: boolean; bytes: Uint8Array }

/** Bytes of an element. */
export const sizeOf = (type: string) => Number(type.slice(1));

function columns({ name, components, type, little, bytes }: VtkArray): NamedColumns {
  const field = { name: '', type, little, components: 1, offset: 0 };
  const rows = bytes.length / sizeOf(type) / components;
  return columnsOf({
    fields: [field], isStructured: false, elementBytes: sizeOf(type), isFortran: false, begin: 0,
    shape: components > 1 ? [rows, components] : [rows],
  }, name, bytes);
}

/**
 * The table of a frame: the points, and the arrays that have a row for each point. `fields`: arrays of the whole file,
 * one of which may be the time.
 */
export function tableOf(points: VtkArray | null, arrays: readonly VtkArray[], fields: readonly VtkArray[],
                        index: number, name: string): FrameTable {
  if (!points) throw new InputError(`${name} has no points.`);
  const rows = points.bytes.length / sizeOf(points.type) / 3;
  if (points.components !== 3 || !Number.isInteger(rows)) throw new InputError(`${name} has points without three coordinates.`);
  const all: NamedColumns = { names: [], columns: [] };
  for (const array of [points, ...arrays]) {
    const isOfPoints = array.bytes.length === rows * array.components * sizeOf(array.type);
    if (!isOfPoints || array.components > MOST_COMPONENTS) continue;
    const own = columns(array);
    all.names.push(...own.names);
    all.columns.push(...own.columns);
  }
  const times = fields.filter((field) => /^time(value)?$/i.test(field.name) && field.bytes.length === sizeOf(field.type));
  const time = times.length > 0 ? columns(times[0]).columns[0].number(0) : NaN;
  return {
    names: all.names, columnCount: all.names.length, rows: new NumberRows(all.columns, rows), index, name,
    time: Number.isFinite(time) ? time : null,
  };
}

/** Numbers of text as an array: int64 if `isWhole` and all words are whole numbers, else float64. */
export function textArray(name: string, components: number, words: readonly string[], isWhole: boolean): VtkArray {
  const bytes = isWhole && words.every((word) => /^-?\d+$/.test(word))
    ? BigInt64Array.from(words, BigInt) : Float64Array.from(words, Number);
  return {
    name, components, type: isWhole && bytes instanceof BigInt64Array ? 'i8' : 'f8', little: true,
    bytes: new Uint8Array(bytes.buffer),
  };
}
