// NPZ files of NumPy: a zip archive with an NPY array per column of one frame.
import {
  columnsOf, elementsOf, MOST_COMPONENTS, type NamedColumns, type NpyHeader, parseNpyHeader,
} from './npy';
import { NumberRows } from './rows';
import { InputError } from './source';
import type { FrameTable, TableReader } from './table_source';

const END_MAGIC = 0x06054b50;
const ENTRY_MAGIC = 0x02014b50;
const END_BYTES = 22;
const ENTRY_BYTES = 46;
const LOCAL_BYTES = 30;
/** Largest comment after the end mark of an archive, in bytes. The mark is searched backwards over this distance. */
const MOST_COMMENT_BYTES = 65_535;
const STORED = 0;
const DEFLATED = 8;
/** Largest number of bytes to which deflate can unpack one byte. */
const MOST_EXPANSION = 1032;

interface ZipEntry { name: string; method: number; packed: number; size: number; at: number }

/** The entries of a zip archive. Throws InputError. */
async function entriesOf(file: Blob, name: string): Promise<ZipEntry[]> {
  const damaged = () => new InputError(`${name} is truncated or damaged: the list of its arrays is missing.`);
  const viewOf = async (from: number, to: number) => new DataView(await file.slice(from, to).arrayBuffer());
  const tail = await viewOf(Math.max(0, file.size - END_BYTES - MOST_COMMENT_BYTES), file.size);
  let end = tail.byteLength - END_BYTES;
  while (end >= 0 && tail.getUint32(end, true) !== END_MAGIC) --end;
  if (end < 0) throw damaged();
  const begin = tail.getUint32(end + 16, true);
  if (begin === 0xffffffff) throw new InputError(`${name} is a zip archive above 4 GiB, which the page cannot read.`);
  const list = await viewOf(begin, begin + tail.getUint32(end + 12, true));
  const entries: ZipEntry[] = [];
  for (let at = 0; at + ENTRY_BYTES <= list.byteLength;) {
    if (list.getUint32(at, true) !== ENTRY_MAGIC) throw damaged();
    const length = list.getUint16(at + 28, true);
    if (at + ENTRY_BYTES + length > list.byteLength) throw damaged();
    entries.push({
      name: new TextDecoder().decode(new Uint8Array(list.buffer, at + ENTRY_BYTES, length)),
      method: list.getUint16(at + 10, true), packed: list.getUint32(at + 20, true),
      size: list.getUint32(at + 24, true), at: list.getUint32(at + 42, true),
    });
    at += ENTRY_BYTES + length + list.getUint16(at + 30, true) + list.getUint16(at + 32, true);
  }
  return entries;
}

/** The unpacked bytes of an entry. Throws InputError. */
async function bytesOf(file: Blob, entry: ZipEntry, name: string): Promise<Uint8Array> {
  const local = new DataView(await file.slice(entry.at, entry.at + LOCAL_BYTES).arrayBuffer());
  if (local.byteLength < LOCAL_BYTES) throw new InputError(`${name}: ${entry.name} is damaged.`);
  const begin = entry.at + LOCAL_BYTES + local.getUint16(26, true) + local.getUint16(28, true);
  const packed = file.slice(begin, begin + entry.packed);
  if (entry.method !== STORED && entry.method !== DEFLATED) {
    throw new InputError(`${name}: ${entry.name} is packed by an unknown method. Use numpy.savez.`);
  }
  if (entry.size > MOST_EXPANSION * entry.packed + LOCAL_BYTES) {
    throw new InputError(`${name}: ${entry.name} is damaged: its size is wrong.`);
  }
  const stream = entry.method === STORED ? packed.stream()
    : packed.stream().pipeThrough(new DecompressionStream('deflate-raw'));
  const bytes = new Uint8Array(entry.size);
  let at = 0;
  const reader = (stream as ReadableStream<Uint8Array>).getReader();
  try {
    for (let piece = await reader.read(); !piece.done; piece = await reader.read()) {
      bytes.set(piece.value, at);  // Throws if the entry unpacks to more than its list says.
      at += piece.value.length;
    }
  } catch {
    at = -1;
  }
  if (at !== entry.size) throw new InputError(`${name}: ${entry.name} is damaged.`);
  return bytes;
}

interface NamedArray { name: string; header: NpyHeader; elements: Uint8Array }

/** An NPZ file: one frame. */
export class NpzReader implements TableReader {
  readonly count = 1;

  constructor(private readonly file: Blob, private readonly name: string) {}

  async table(index: number): Promise<FrameTable> {
    const { name } = this;
    const arrays = await this.arrays();
    const times = arrays.filter((array) => /^(t|time)$/.test(array.name) && elementsOf(array.header) === 1);
    const columns: NamedColumns = { names: [], columns: [] };
    const rows = rowsOf(arrays);
    for (const array of arrays) {
      // Arrays of another length are not of the particles.
      if (times.includes(array) || !isTable(array) || array.header.shape[0] !== rows) continue;
      const own = columnsOf(array.header, array.name, array.elements);
      columns.names.push(...own.names);
      columns.columns.push(...own.columns);
    }
    if (columns.names.length === 0) throw new InputError(`${name} has no array with a row per particle.`);
    const time = times.length > 0
      ? columnsOf({ ...times[0].header, shape: [1] }, '', times[0].elements).columns[0].number(0) : null;
    return {
      names: columns.names, columnCount: columns.names.length, rows: new NumberRows(columns.columns, rows), index, name,
      time: time !== null && Number.isFinite(time) ? time : null,
    };
  }

  private async arrays(): Promise<NamedArray[]> {
    const entries = await entriesOf(this.file, this.name);
    const has = (name: string) => entries.some((entry) => entry.name === `${name}.npy`);
    if (has('particles') && has('solver_data') && has('version')) {
      throw new InputError(`${this.name} is an NPZ file of PySPH, which the page cannot read. Run partiemc convert ` +
        `${this.name} out.pemc, and open out.pemc here.`);
    }
    const arrays: NamedArray[] = [];
    let refusal: InputError | null = null;
    for (const entry of entries.filter((one) => one.name.endsWith('.npy'))) {
      const bytes = await bytesOf(this.file, entry, this.name);
      const name = entry.name.slice(0, -4);
      try {
        const header = parseNpyHeader(bytes, `${this.name}: ${name}`);
        const elements = bytes.subarray(header.begin);
        if (elements.length !== elementsOf(header) * header.elementBytes) {
          throw new InputError(`${this.name}: ${name} is truncated.`);
        }
        arrays.push({ name, header, elements });
      } catch (error) {
        if (!(error instanceof InputError)) throw error;
        refusal ??= error;  // Arrays of text or objects are no columns.
      }
    }
    if (arrays.length === 0 && refusal) throw refusal;
    return arrays;
  }
}

function isTable({ header: { shape } }: NamedArray): boolean {
  return shape.length === 1 || (shape.length === 2 && shape[1] <= MOST_COMPONENTS);
}

/** Number of particles: the rows of positions, or of the first array. */
function rowsOf(arrays: readonly NamedArray[]): number {
  const tables = arrays.filter(isTable);
  const positions = tables.find(({ name }) => /^(x|pos|positions?|points?|coords?|coordinates?|xyz?|r)$/i.test(name));
  return (positions ?? tables.find(({ header }) => elementsOf(header) > 1) ?? tables[0])?.header.shape[0] ?? 0;
}
