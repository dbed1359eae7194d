// VTK XML files of points: PolyData (.vtp) and UnstructuredGrid (.vtu), as text, base64 or appended
// bytes, plain or compressed by zlib.
import { InputError } from './source';
import type { FrameTable, TableReader } from './table_source';
import { sizeOf, tableOf, textArray, VTK_TYPES, type VtkArray } from './vtk_arrays';

type Attributes = Map<string, string>;

/** The attributes of an XML element. */
export function attributesOf(text: string): Attributes {
  return new Map([...text.matchAll(/([\w:]+)\s*=\s*(?:"([^"]*)"|'([^']*)')/g)]
    .map(([, key, double, single]) => [key, unescaped(double ?? single)]));
}

function unescaped(text: string): string {
  return text.replace(/&(lt|gt|quot|apos|amp);/g, (_, name: string) =>
    ({ lt: '<', gt: '>', quot: '"', apos: "'", amp: '&' })[name] ?? '');
}

/** An array of the file, before its numbers are read. */
interface Declared { section: string; attributes: Attributes; text: string }

/** A VTK XML file: one frame. */
export class VtkXmlReader implements TableReader {
  readonly count = 1;

  constructor(private readonly file: Blob, private readonly name: string) {}

  async table(index: number): Promise<FrameTable> {
    const document = new Document(new Uint8Array(await this.file.arrayBuffer()), this.name);
    const arraysOf = (section: string) => Promise.all(document.arrays.filter((array) => array.section === section)
      .map((array) => document.read(array)));
    const found = (await arraysOf('Points'))[0] ?? null;
    const points = found && { ...found, name: 'Points' };
    return tableOf(points, await arraysOf('PointData'), await arraysOf('FieldData'), index, this.name);
  }
}

class Document {
  readonly arrays: Declared[] = [];
  private readonly little: boolean;
  private readonly headerBytes: number;
  private readonly isPacked: boolean;
  /** Offset of the appended bytes in the file. */
  private appended = -1;
  private isBase64 = false;

  constructor(private readonly bytes: Uint8Array, private readonly name: string) {
    const text = new TextDecoder('latin1').decode(bytes);  // One character per byte.
    const mark = /<AppendedData[^>]*>\s*_/.exec(text);
    if (mark) {
      this.appended = mark.index + mark[0].length;
      this.isBase64 = /encoding\s*=\s*"base64"/.test(mark[0]);
    }
    const head = mark ? text.slice(0, mark.index) : text;
    const file = attributesOf(/<VTKFile([^>]*)>/.exec(head)?.[1] ?? '');
    const type = file.get('type') ?? '';
    if (type !== 'PolyData' && type !== 'UnstructuredGrid') {
      throw new InputError(`${name} is a VTK file of the type ${type}, which the page cannot read. Open .vtp or .vtu files.`);
    }
    const compressor = file.get('compressor') ?? '';
    this.isPacked = compressor !== '';
    if (this.isPacked && compressor !== 'vtkZLibDataCompressor') {
      throw new InputError(`${name} is compressed by ${compressor}, which the page cannot read. ` +
        `Run partiemc convert ${name} out.pemc, and open out.pemc here.`);
    }
    this.little = file.get('byte_order') !== 'BigEndian';
    this.headerBytes = file.get('header_type') === 'UInt64' ? 8 : 4;
    this.declare(head);
  }

  /** Finds the arrays. */
  private declare(head: string): void {
    let section = '';
    let pieces = 0;
    for (const tag of head.matchAll(/<(Piece|FieldData|PointData|CellData|Points|Cells|Verts|Lines|Strips|Polys|DataArray)\b([^>]*)>/g)) {
      const [whole, kind, given] = tag;
      if (kind === 'Piece') {
        if (Number(attributesOf(given).get('NumberOfPoints')) > 0 && ++pieces > 1) {
          throw new InputError(`${this.name} has several pieces, which the page cannot read. ` +
            `Run partiemc convert ${this.name} out.pemc, and open out.pemc here.`);
        }
      } else if (kind !== 'DataArray') {
        section = kind;
      } else {
        const begin = tag.index + whole.length;
        const end = head.indexOf('<', begin);
        const text = whole.endsWith('/>') ? '' : head.slice(begin, end < 0 ? undefined : end);
        this.arrays.push({ section, attributes: attributesOf(given), text });
      }
    }
  }

  /** The numbers of an array. Throws InputError. */
  async read({ attributes, text }: Declared): Promise<VtkArray> {
    const name = attributes.get('Name') ?? '';
    const components = Number(attributes.get('NumberOfComponents') ?? 1) || 1;
    const type = VTK_TYPES[attributes.get('type') ?? ''];
    const format = attributes.get('format');
    if (!type) return { name, components, type: 'u1', little: true, bytes: new Uint8Array(0) };
    if (format === 'ascii') {
      return textArray(name, components, text.trim().split(/\s+/).filter(Boolean), !type.startsWith('f'));
    }
    try {
      const isAppended = format === 'appended';
      const at = this.appended + Number(attributes.get('offset'));
      const raw = isAppended && !this.isBase64 ? this.bytes.subarray(at) : null;
      const letters = isAppended ? new TextDecoder('latin1').decode(this.bytes.subarray(at)) : text.trim();
      const bytes = await (this.isPacked ? this.unpack(raw, letters) : this.plain(raw, letters));
      if (bytes.length % (components * sizeOf(type)) !== 0) throw new Error('a part of a row');
      return { name, components, type, little: this.little, bytes };
    } catch {
      throw new InputError(`${this.name}: the array ${name} is truncated or damaged.`);
    }
  }

  private number(bytes: Uint8Array, k: number): number {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    return this.headerBytes === 8 ? Number(view.getBigUint64(8 * k, this.little)) : view.getUint32(4 * k, this.little);
  }

  /** The bytes of an uncompressed array. Their length, in bytes, is before them. */
  private plain(raw: Uint8Array | null, letters: string): Uint8Array {
    const { headerBytes } = this;
    const length = this.number(raw ?? fromBase64(letters, headerBytes), 0);
    const bytes = raw ?? fromBase64(letters, headerBytes + length);
    if (bytes.length < headerBytes + length) throw new Error('truncated');
    return bytes.slice(headerBytes, headerBytes + length);
  }

  /** Decompresses an array: number of blocks, their length, length of the last one, packed lengths; then the blocks. */
  private async unpack(raw: Uint8Array | null, letters: string): Promise<Uint8Array> {
    const { headerBytes } = this;
    const count = this.number(raw ?? fromBase64(letters, headerBytes), 0);
    const head = (3 + count) * headerBytes;
    const header = raw ?? fromBase64(letters, head);
    // In base64, header and blocks are encoded separately.
    const blocks = raw?.subarray(head) ?? fromBase64(letters.slice(4 * Math.ceil(head / 3)), Infinity);
    const parts: Uint8Array[] = [];
    let at = 0;
    for (let k = 0; k < count; ++k) {
      const size = this.number(header, 3 + k);
      parts.push(await inflated(blocks.slice(at, at + size)));
      at += size;
    }
    return new Uint8Array(await new Blob(parts as BlobPart[]).arrayBuffer());
  }
}

async function inflated(bytes: Uint8Array): Promise<Uint8Array> {
  const stream = new Blob([bytes as BlobPart]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Decodes the first `bytes` bytes, rounded up to threes, of a base64 text, which ends at the first other character. */
function fromBase64(text: string, bytes: number): Uint8Array {
  const letters = /^[A-Za-z0-9+/]*={0,2}/.exec(text.slice(0, 4 * Math.ceil(bytes / 3)))?.[0] ?? '';
  return Uint8Array.from(atob(letters), (letter) => letter.charCodeAt(0));
}
