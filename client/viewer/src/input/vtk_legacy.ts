// Legacy VTK files of points: POLYDATA and UNSTRUCTURED_GRID of versions 1.0 to 5.1, as text or bytes.
import { InputError } from './source';
import type { FrameTable, TableReader } from './table_source';
import { sizeOf, tableOf, textArray, type VtkArray } from './vtk_arrays';

/** Types of legacy files by the codes of NumPy. */
const TYPES: Record<string, string> = {
  float: 'f4', double: 'f8', char: 'i1', signed_char: 'i1', unsigned_char: 'u1', short: 'i2', unsigned_short: 'u2',
  int: 'i4', unsigned_int: 'u4', long: 'i8', unsigned_long: 'u8', vtkidtype: 'i4', vtktypeint64: 'i8',
  vtktypeuint64: 'u8', vtktypeint32: 'i4',
};
const LEAST_VECTOR = /^(VECTORS|NORMALS)$/;
const CELLS = /^(VERTICES|LINES|POLYGONS|TRIANGLE_STRIPS|CELLS)$/;

/** A legacy VTK file: one frame. */
export class VtkLegacyReader implements TableReader {
  readonly count = 1;

  constructor(private readonly file: Blob, private readonly name: string) {}

  async table(index: number): Promise<FrameTable> {
    const parser = new Parser(new Uint8Array(await this.file.arrayBuffer()), this.name);
    parser.parse();
    return tableOf(parser.points, parser.arrays, parser.fields, index, this.name);
  }
}

/** VTK writes bytes of a name that are not printable as %XX. A name whose bytes are not UTF-8 stays encoded. */
function decodedName(name: string): string {
  try {
    return decodeURIComponent(name.replace(/%(?![0-9A-F]{2})/g, '%25'));
  } catch {
    return name;
  }
}

class Parser {
  points: VtkArray | null = null;
  readonly arrays: VtkArray[] = [];
  readonly fields: VtkArray[] = [];
  private readonly text: string;
  private at = 0;
  private isBinary = false;
  /** Number of rows of the arrays that follow; null for those of the whole file. */
  private rows: number | null = null;
  private isOfPoints = false;

  constructor(private readonly bytes: Uint8Array, private readonly name: string) {
    this.text = new TextDecoder('latin1').decode(bytes);  // One character per byte.
  }

  parse(): void {
    this.line();
    this.line();
    this.isBinary = this.line().trim().toUpperCase() === 'BINARY';
    for (let line = this.next(); line !== null; line = this.next()) this.section(line.trim().split(/\s+/));
  }

  private section(words: string[]): void {
    const [keyword, first, second, third] = words;
    const kind = keyword.toUpperCase();
    if (kind === 'DATASET') {
      if (!/^(POLYDATA|UNSTRUCTURED_GRID)$/i.test(first)) {
        throw new InputError(`${this.name} is a legacy VTK file of the type ${first}, which the page cannot read. ` +
          'Save POLYDATA or UNSTRUCTURED_GRID.');
      }
    } else if (kind === 'POINTS') this.points = this.array('Points', 3, Number(first), second);
    else if (CELLS.test(kind)) this.cells(Number(first), Number(second));
    else if (kind === 'CELL_TYPES') this.array('', 1, Number(first), 'int');
    else if (kind === 'POINT_DATA' || kind === 'CELL_DATA') {
      this.rows = Number(first);
      this.isOfPoints = kind === 'POINT_DATA';
    } else if (kind === 'SCALARS') {
      const mark = this.at;
      if (!/^\s*LOOKUP_TABLE/i.test(this.next() ?? '')) this.at = mark;
      this.add(this.array(first, Number(third ?? 1) || 1, this.rows ?? 0, second));
    } else if (LEAST_VECTOR.test(kind)) this.add(this.array(first, 3, this.rows ?? 0, second));
    else if (/^TENSORS6?$/.test(kind)) this.add(this.array(first, kind === 'TENSORS6' ? 6 : 9, this.rows ?? 0, second));
    else if (kind === 'TEXTURE_COORDINATES') this.add(this.array(first, Number(second), this.rows ?? 0, third));
    else if (kind === 'FIELD') this.field(Number(second));
    else if (kind === 'METADATA') {
      while (this.at < this.text.length && this.line().trim() !== '');
    } else if (kind === 'LOOKUP_TABLE') this.array('', 4, Number(second), this.isBinary ? 'unsigned_char' : 'float');
    else if (kind === 'COLOR_SCALARS') this.array('', Number(second), this.rows ?? 0, this.isBinary ? 'unsigned_char' : 'float');
    else throw this.damaged(`the section ${keyword.slice(0, 30)} is unknown`);
  }

  private add(array: VtkArray): void {
    if (this.isOfPoints) this.arrays.push(array);
  }

  private field(count: number): void {
    for (let k = 0; k < count; ++k) {
      let words = (this.next() ?? '').trim().split(/\s+/);
      if (words[0] === 'METADATA') {
        while (this.at < this.text.length && this.line().trim() !== '');
        words = (this.next() ?? '').trim().split(/\s+/);
      }
      const [name, components, rows, type] = words;
      const array = this.array(name, Number(components), Number(rows), type ?? '');
      if (this.rows === null) this.fields.push(array);
      else this.add(array);
    }
  }

  /** Skips cells. From version 5 on, offsets and connectivity are arrays of their own. */
  private cells(count: number, size: number): void {
    const mark = this.at;
    const [keyword, type] = (this.next() ?? '').trim().split(/\s+/);
    if (keyword !== 'OFFSETS') {
      this.at = mark;
      this.array('', 1, size, 'int');
      return;
    }
    this.array('', 1, count, type);
    const [, other] = (this.next() ?? '').trim().split(/\s+/);
    this.array('', 1, size, other ?? type);
  }

  /** Reads `components` * `rows` numbers at the current position. */
  private array(name: string, components: number, rows: number, typeName: string): VtkArray {
    const type = TYPES[typeName.toLowerCase()];
    const count = components * rows;
    if (!type || !Number.isInteger(count) || count < 0) throw this.damaged(`the array ${name} has the type ${typeName}`);
    const title = decodedName(name);
    if (this.isBinary) {
      const end = this.at + count * sizeOf(type);
      if (end > this.bytes.length) throw this.damaged('it is truncated');
      const bytes = this.bytes.slice(this.at, end);
      this.at = end;
      return { name: title, components, type, little: false, bytes };
    }
    const words: string[] = [];
    const word = /\S+/g;
    word.lastIndex = this.at;
    for (let k = 0; k < count; ++k) {
      const found = word.exec(this.text);
      if (!found || Number.isNaN(Number(found[0])) && !/^[+-]?nan$/i.test(found[0])) throw this.damaged('it is truncated');
      words.push(found[0]);
      this.at = word.lastIndex;
    }
    return textArray(title, components, words, !type.startsWith('f'));
  }

  private line(): string {
    const end = this.text.indexOf('\n', this.at);
    const line = this.text.slice(this.at, end < 0 ? undefined : end);
    this.at = end < 0 ? this.text.length : end + 1;
    return line;
  }

  /** The next line with text; null at the end of the file. */
  private next(): string | null {
    while (this.at < this.text.length) {
      const line = this.line();
      if (line.trim() !== '') return line;
    }
    return null;
  }

  private damaged(what: string): InputError {
    return new InputError(`${this.name} is damaged: ${what}.`);
  }
}
