// NPY arrays of NumPy: numbers, or structured arrays with named fields.
import type { NumberColumn } from './rows';
import { NumberRows } from './rows';
import { InputError } from './source';
import type { FrameTable, TableReader } from './table_source';

/** Arrays with more components than this are no columns of particles. */
export const MOST_COMPONENTS = 16;
/** Largest number of columns of a plain NPY file. More columns indicate a transposed array. */
const MOST_COLUMNS = 4096;
/** Largest header. numpy.load has a limit of 10,000 bytes. */
const MOST_HEADER_BYTES = 65_536;

type Getter = (view: DataView, at: number, little: boolean) => number | bigint;

/** Element types by NumPy's codes. */
const TYPES: Record<string, { bytes: number; get: Getter }> = {
  f4: { bytes: 4, get: (view, at, little) => view.getFloat32(at, little) },
  f8: { bytes: 8, get: (view, at, little) => view.getFloat64(at, little) },
  i1: { bytes: 1, get: (view, at) => view.getInt8(at) },
  i2: { bytes: 2, get: (view, at, little) => view.getInt16(at, little) },
  i4: { bytes: 4, get: (view, at, little) => view.getInt32(at, little) },
  i8: { bytes: 8, get: (view, at, little) => view.getBigInt64(at, little) },
  u1: { bytes: 1, get: (view, at) => view.getUint8(at) },
  b1: { bytes: 1, get: (view, at) => view.getUint8(at) },
  u2: { bytes: 2, get: (view, at, little) => view.getUint16(at, little) },
  u4: { bytes: 4, get: (view, at, little) => view.getUint32(at, little) },
  u8: { bytes: 8, get: (view, at, little) => view.getBigUint64(at, little) },
};

/** A field of an element. `name` is empty if the array has no fields. */
interface Field { name: string; type: string; little: boolean; components: number; offset: number }

export interface NpyHeader {
  fields: Field[];
  isStructured: boolean;
  elementBytes: number;
  isFortran: boolean;
  shape: number[];
  /** Offset of the first element. */
  begin: number;
}

type Literal = string | number | boolean | null | Literal[] | { [key: string]: Literal };

/** Parses a Python literal: dicts, lists, tuples, strings, whole numbers, True, False, None. Throws on others. */
export function parsePython(text: string): Literal {
  const tokens = text.match(/'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"|[{}[\](),:]|[^\s{}[\](),:'"]+/g) ?? [];
  let at = 0;
  const listTo = (end: string): Literal[] => {
    const items: Literal[] = [];
    while (tokens[at] !== end) {
      items.push(value());
      if (tokens[at] === ',') ++at;
      else if (tokens[at] !== end) throw new Error('no end of a list');
    }
    ++at;
    return items;
  };
  const value = (): Literal => {
    const token = tokens[at++];
    if (token === undefined) throw new Error('no value');
    if (token === '(') return listTo(')');
    if (token === '[') return listTo(']');
    if (token === '{') {
      const dict: { [key: string]: Literal } = {};
      while (tokens[at] !== '}') {
        const key = String(value());
        if (tokens[at++] !== ':') throw new Error('no value of a key');
        dict[key] = value();
        if (tokens[at] === ',') ++at;
      }
      ++at;
      return dict;
    }
    if (token === 'True' || token === 'False') return token === 'True';
    if (token === 'None') return null;
    if (/^['"]/.test(token)) return token.slice(1, -1).replace(/\\(.)/g, '$1');
    if (/^\d+L?$/.test(token)) return parseInt(token, 10);
    throw new Error(`unknown value ${token}`);
  };
  return value();
}

/** Parses the beginning of an array. Throws InputError. */
export function parseNpyHeader(bytes: Uint8Array, name: string): NpyHeader {
  const damaged = (what: string) => new InputError(`${name}: ${what}`);
  if (bytes.length < 12 || new TextDecoder('latin1').decode(bytes.subarray(1, 6)) !== 'NUMPY') {
    throw damaged('This is no NPY array.');
  }
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const isShort = bytes[6] === 1;
  const length = isShort ? view.getUint16(8, true) : view.getUint32(8, true);
  const begin = (isShort ? 10 : 12) + length;
  if (length > MOST_HEADER_BYTES || begin > bytes.length) throw damaged('The NPY header is damaged or truncated.');
  let dict: Literal;
  try {
    dict = parsePython(new TextDecoder('latin1').decode(bytes.subarray(begin - length, begin)));
  } catch {
    throw damaged('The NPY header is damaged.');
  }
  const { descr, fortran_order: isFortran, shape } = dict as { [key: string]: Literal };
  if (!Array.isArray(shape) || !shape.every((extent) => typeof extent === 'number') || descr === undefined) {
    throw damaged('The NPY header is damaged.');
  }
  return { ...fieldsOf(descr, name), isFortran: isFortran === true, shape: shape as number[], begin };
}

/** Parses the type of an element: '<f8', or a list of (name, type[, extents]). */
function fieldsOf(descr: Literal, name: string): Pick<NpyHeader, 'fields' | 'isStructured' | 'elementBytes'> {
  const isStructured = Array.isArray(descr);
  const fields: Field[] = [];
  let elementBytes = 0;
  for (const part of isStructured ? descr : [['', descr]]) {
    const [field, code, extents = []] = part as Literal[];
    if (typeof field !== 'string' || typeof code !== 'string') {
      throw new InputError(`${name} has nested fields. Save its fields as plain arrays in an NPZ.`);
    }
    if (code.includes('O')) {
      throw new InputError(`${name} holds pickled Python objects, which are not read here. Save plain arrays, ` +
        "for example numpy.savez('frame.npz', x=x, y=y).");
    }
    const [, order, kind, size] = /^([<>|=]?)([A-Za-z])(\d+)$/.exec(code) ?? [];
    const type = TYPES[`${kind}${size}`];
    if (!kind || (!type && !isStructured)) {
      throw new InputError(`${name} has elements of the type '${code}'. Save float32, float64 or integers.`);
    }
    const components = [extents].flat().reduce<number>((product, extent) => product * Number(extent), 1);
    if (type && components <= MOST_COMPONENTS) {
      fields.push({ name: field, type: kind + size, little: order !== '>', components, offset: elementBytes });
    }
    elementBytes += components * (type?.bytes ?? Number(size) * (kind === 'U' ? 4 : 1));
  }
  if (fields.length === 0) throw new InputError(`${name} has no field of numbers. Save x and y.`);
  return { fields, isStructured, elementBytes };
}

export interface NamedColumns { names: string[]; columns: NumberColumn[] }

/**
 * The columns of an array of rows, or of rows and components. `bytes`: of its elements. `stem`: the
 * name of the array.
 */
export function columnsOf(header: NpyHeader, stem: string, bytes: Uint8Array): NamedColumns {
  const { fields, isStructured, elementBytes, isFortran, shape } = header;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const [rows, across = 1] = shape;
  const stride = elementBytes * (isFortran ? 1 : across);
  const out: NamedColumns = { names: [], columns: [] };
  for (let k = 0; k < across; ++k) {
    const begin = k * elementBytes * (isFortran ? rows : 1);
    for (const { name, type, little, components, offset } of fields) {
      const array = (isStructured ? name : stem) + (shape.length === 2 ? `:${k}` : '');
      const { bytes: size, get } = TYPES[type];
      for (let c = 0; c < components; ++c) {
        const first = begin + offset + c * size;
        const at = (row: number) => get(view, first + row * stride, little);
        out.names.push(components === 1 ? array : `${array}:${c}`);
        out.columns.push({
          number: (row) => Number(at(row)),
          id: (row) => {
            const value = at(row);
            return typeof value === 'bigint' ? (value >= 0n ? value : null)
              : Number.isInteger(value) && value >= 0 ? BigInt(value) : null;
          },
        });
      }
    }
  }
  return out;
}

/** Number of the elements. */
export const elementsOf = ({ shape }: NpyHeader) => shape.reduce((product, extent) => product * extent, 1);

/** An NPY file: rows of particles, or frames of them. */
export class NpyReader implements TableReader {
  private constructor(private readonly file: Blob, private readonly name: string,
                      private readonly header: NpyHeader, readonly count: number) {}

  /** Reads the header. Throws InputError. */
  static async open(file: Blob, name: string): Promise<NpyReader> {
    const head = new Uint8Array(await file.slice(0, MOST_HEADER_BYTES + 12).arrayBuffer());
    const header = parseNpyHeader(head, name);
    const whole = header.begin + elementsOf(header) * header.elementBytes;
    if (file.size !== whole) {
      throw new InputError(`${name} has ${file.size} of ${whole} bytes. ` +
        (file.size < whole ? 'It is truncated.' : 'Save one array per file.'));
    }
    const { shape, isStructured, isFortran } = header;
    const holdsFrames = shape.length === (isStructured ? 2 : 3);
    const isTable = holdsFrames || shape.length === (isStructured ? 1 : 2);
    if (!isTable || (!isStructured && shape[shape.length - 1] > MOST_COLUMNS)) {
      throw new InputError(`${name} has the shape (${shape.join(', ')}). Save an array of the shape (particles, 2 or 3), ` +
        'or (frames, particles, 2 or 3).');
    }
    if (holdsFrames && isFortran) {
      throw new InputError(`${name} holds frames in Fortran order. Save numpy.ascontiguousarray(frames).`);
    }
    if (holdsFrames && shape[0] === 0) throw new InputError(`${name} holds no frame.`);
    return new NpyReader(file, name, holdsFrames ? { ...header, shape: shape.slice(1) } : header,
                         holdsFrames ? shape[0] : 1);
  }

  async table(index: number): Promise<FrameTable> {
    const { header, name } = this;
    const size = elementsOf(header) * header.elementBytes;
    const begin = header.begin + index * size;
    const bytes = new Uint8Array(await this.file.slice(begin, begin + size).arrayBuffer());
    const { names, columns } = columnsOf(header, '', bytes);
    return {
      names: header.isStructured ? names : [], columnCount: columns.length, index, time: null,
      rows: new NumberRows(columns, header.shape[0]), name: this.count > 1 ? `${name}, frame ${index}` : name,
    };
  }
}
