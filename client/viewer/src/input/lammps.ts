// LAMMPS text dumps of the styles atom and custom. A frame has sections that start with "ITEM:".
import type { Place } from './particles';
import type { RecordedBox } from './periodic';
import { TextRows } from './rows';
import { InputError } from './source';
import { splitAtBlanks } from './table';
import type { FrameTable, TableReader } from './table_source';

/** A position in the box is origin + sum over axes of (fraction * edge). */
interface Box { origin: number[]; edges: number[][] }

/** `flags`: the rest of the line "ITEM: BOX BOUNDS": "pp pp ff", "xy xz yz pp pp pp", or nothing. */
function recordedBox({ origin, edges }: Box, flags: string): RecordedBox {
  // Other words name tilts. A boundary has two letters of p, f, s, m.
  const boundaries = splitAtBlanks(flags).filter((word) => /^[pfsm]{2}$/.test(word));
  return {
    axes: [0, 1, 2].map((k) => boundaries[k] === 'pp' ? { origin: origin[k], length: edges[k][k] } : undefined),
    isTilted: edges.some((edge, k) => edge.some((part, axis) => axis !== k && part !== 0)),
  };
}

/** Parses lower and upper bounds. A triclinic box has tilts xy, xz, yz, which widen the bounds. */
function boxOf(lines: string[]): Box {
  const numbers = lines.map((line) => splitAtBlanks(line).map(Number));
  const low = numbers.map((line) => line[0]);
  const high = numbers.map((line) => line[1]);
  const [xy, xz, yz] = numbers.map((line) => line[2] ?? 0);
  low[0] -= Math.min(0, xy, xz, xy + xz);
  high[0] -= Math.max(0, xy, xz, xy + xz);
  low[1] -= Math.min(0, yz);
  high[1] -= Math.max(0, yz);
  return {
    origin: low,
    edges: [[high[0] - low[0], 0, 0], [xy, high[1] - low[1], 0], [xz, yz, high[2] - low[2]]],
  };
}

/** "ITEM: BOX BOUNDS abc origin": each line has an edge and a coordinate of the origin. */
function boxOfEdges(lines: string[]): Box {
  const numbers = lines.map((line) => splitAtBlanks(line).map(Number));
  return { origin: numbers.map((line) => line[3]), edges: numbers.map((line) => line.slice(0, 3)) };
}

function placeIn(box: Box | null, where: string): Place {
  return (axes, images, scaled) => {
    if (!box && scaled) throw new InputError(`${where}: scaled positions without a box.`);
    images.forEach((crossings, a) => crossings?.forEach((image, i) => {
      if (!Number.isInteger(image)) throw new InputError(`${where}: the image flag ${image} is no whole number.`);
      if (image === 0) return;
      if (!box) throw new InputError(`${where}: image flags (ix iy) without a box.`);
      const shift = scaled ? [0, 1, 2].map((k) => Number(k === a)) : box.edges[a];
      axes.forEach((axis, k) => { if (axis) axis[i] += image * shift[k]; });
    }));
    if (box && scaled) unscale(axes, box);
  };
}

/** Converts fractions of the box to coordinates. An axis that the dump lacks counts as 0. */
function unscale(axes: (Float64Array | null)[], box: Box): void {
  const count = axes.find((axis) => axis)?.length ?? 0;
  for (let i = 0; i < count; ++i) {
    const point = [...box.origin];
    axes.forEach((axis, a) => {
      if (axis) box.edges[a].forEach((edge, k) => { if (edge !== 0) point[k] += axis[i] * edge; });
    });
    axes.forEach((axis, a) => { if (axis) axis[i] = point[a]; });
  }
}

/** Parses one frame. Throws InputError. */
export function parseLammpsFrame(text: string, index: number, name: string): FrameTable {
  const where = `${name}, frame ${index + 1}`;
  const lines = text.split(/\r?\n/);
  let time: number | null = null;
  let step: number | undefined;
  let atoms = -1;
  let box: Box | null = null;
  let flags = '';
  for (let k = 0; k < lines.length; ++k) {
    const line = lines[k];
    if (line.startsWith('ITEM: NUMBER OF ATOMS')) {
      atoms = Number(lines[++k]);
    } else if (line.startsWith('ITEM: BOX BOUNDS')) {
      box = (line.includes('abc') ? boxOfEdges : boxOf)(lines.slice(k + 1, k + 4));
      flags = line.slice('ITEM: BOX BOUNDS'.length);
      k += 3;
    } else if (line.startsWith('ITEM: TIMESTEP')) {
      step = Number(lines[++k]);
    } else if (line.startsWith('ITEM: TIME')) {
      time = Number(lines[++k]);
    } else if (line.startsWith('ITEM: ATOMS')) {
      const names = splitAtBlanks(line.slice('ITEM: ATOMS'.length));
      const rows = lines.slice(k + 1, k + 1 + atoms).filter((row) => row !== '').map(splitAtBlanks);
      if (rows.length !== atoms || rows.some((cells) => cells.length < names.length)) {
        throw new InputError(`${where} has ${rows.length} of ${atoms} atoms. It is truncated.`);
      }
      return {
        names, columnCount: names.length, rows: new TextRows(rows, where), time, step, index, name: where,
        place: placeIn(box, where), box: box ? recordedBox(box, flags) : undefined,
      };
    }
  }
  throw new InputError(`${where} has no atoms. Only text dumps of the styles atom and custom can be read.`);
}

const FRAME_MARK = 'ITEM: TIMESTEP';
const CHUNK_BYTES = 4 << 20;

/** A dump. Frames are read on demand. */
export class LammpsReader implements TableReader {
  private constructor(private readonly file: Blob, private readonly name: string,
                      private readonly offsets: number[]) {}

  static async open(file: Blob, name: string): Promise<LammpsReader> {
    const offsets = await marksOf(file);
    if (offsets.length === 0) throw new InputError(`${name} has no frame of a LAMMPS dump.`);
    return new LammpsReader(file, name, [...offsets, file.size]);
  }

  get count(): number { return this.offsets.length - 1; }

  async table(index: number): Promise<FrameTable> {
    const text = await this.file.slice(this.offsets[index], this.offsets[index + 1]).text();
    return parseLammpsFrame(text, index, this.name);
  }
}

/** Offsets of the frames of a dump. Reads the file once, in pieces. */
async function marksOf(file: Blob): Promise<number[]> {
  const offsets: number[] = [];
  for (let at = 0; at < file.size; at += CHUNK_BYTES) {
    const piece = file.slice(at, at + CHUNK_BYTES + FRAME_MARK.length - 1);
    const text = new TextDecoder('latin1').decode(await piece.arrayBuffer());
    for (let k = text.indexOf(FRAME_MARK); k >= 0; k = text.indexOf(FRAME_MARK, k + 1)) {
      offsets.push(at + k);
    }
  }
  return offsets;
}
