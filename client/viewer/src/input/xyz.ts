// XYZ text: a count, a line of comment, then lines of "type x y z"; frame after frame. In extended XYZ
// the comment describes the columns and the box: Properties=species:S:1:pos:R:3 Lattice="9 0 0 0 9 0 0 0 9" Time=0.5.
import type { RecordedBox } from './periodic';
import { TextRows } from './rows';
import { InputError } from './source';
import { splitAtBlanks } from './table';
import type { FrameTable, TableReader } from './table_source';

const PLAIN_COLUMNS = ['type', 'x', 'y', 'z'];
const MOST_COLUMNS = 4096;

/** An edge is parallel to an axis if its other components are at most this share of the longest edge. */
const TILT_TOLERANCE = 1e-9;

/** Whether a file is XYZ text: its first line is a count, and its extension or a comment of LAMMPS says so. */
export function isXyz(head: string, extension: string): boolean {
  const [count, comment = ''] = head.split(/\r?\n/);
  return /^\s*\d+\s*$/.test(count) &&
    (extension === 'xyz' || extension === 'extxyz' || comment.startsWith('Atoms. Timestep:'));
}

/** The value after `key` in a comment: to the next blank, or to the closing quote. Empty without one. */
function valueOf(comment: string, key: string): string {
  const [, quoted, plain] = new RegExp(`(?:^| )${key}(?:"([^"]*)"?|(\\S*))`).exec(comment) ?? [];
  return quoted ?? plain ?? '';
}

function namesOf(properties: string, where: string): string[] {
  if (properties === '') return PLAIN_COLUMNS;
  const parts = properties.split(':');
  const names: string[] = [];
  for (let k = 0; k + 2 < parts.length; k += 3) {
    // OVITO and other programs name velocities "velo".
    const name = parts[k] === 'velo' ? 'velocity' : parts[k];
    const count = Number(parts[k + 2]);
    if (!(Number.isInteger(count) && count > 0 && names.length + count <= MOST_COLUMNS)) return refuse(properties, where);
    for (let c = 0; c < count; ++c) names.push(count === 1 ? name : `${name}:${c}`);
  }
  return parts.length % 3 === 0 ? names : refuse(properties, where);
}

function refuse(properties: string, where: string): never {
  throw new InputError(`${where}: Properties=${properties} must list NAME:TYPE:COLUMNS.`);
}

/** The finite numbers after `key` in a comment. Undefined for anything other than `count` of them. */
function numbersOf(comment: string, key: string, count: number): number[] | undefined {
  const numbers = splitAtBlanks(valueOf(comment, key)).map(Number);
  return numbers.length === count && numbers.every(Number.isFinite) ? numbers : undefined;
}

/** The box by Lattice="..." (edge after edge), Origin="..." (by default 0) and pbc="T T F" (by default all axes). */
function boxOf(comment: string): RecordedBox | undefined {
  const edges = numbersOf(comment, 'Lattice=', 9);
  if (!edges) return undefined;
  const origin = numbersOf(comment, 'Origin=', 3) ?? [0, 0, 0];
  const pbc = splitAtBlanks(valueOf(comment, 'pbc='));
  const longest = Math.max(...edges.map(Math.abs));
  return {
    axes: [0, 1, 2].map((k) =>
      pbc.length !== 3 || /^[Tt1]/.test(pbc[k]) ? { origin: origin[k], length: edges[4 * k] } : undefined),
    isTilted: edges.some((part, k) => k % 4 !== 0 && Math.abs(part) > TILT_TOLERANCE * longest),
  };
}

export class XyzReader implements TableReader {
  private constructor(private readonly lines: readonly string[], private readonly name: string,
                      private readonly starts: readonly number[]) {}

  /** Throws InputError if the file is truncated. */
  static open(text: string, name: string): XyzReader {
    const lines = text.split(/\r?\n/);
    const starts: number[] = [];
    for (let at = 0; at < lines.length;) {
      const count = lines[at].trim();
      if (count === '' && (at > 0 || lines.length === 1)) {
        ++at;
        continue;
      }
      const where = `${name}, frame ${starts.length}`;
      if (!/^\d+$/.test(count)) throw new InputError(`${where}: line ${at + 1} must be the number of particles.`);
      const end = at + 2 + Number(count);
      const there = lines.length - (lines[lines.length - 1] === '' ? 1 : 0);
      if (end > there) {
        throw new InputError(`${where} ends after ${Math.max(0, there - at - 2)} of ${count} particles. The file is truncated.`);
      }
      starts.push(at);
      at = end;
    }
    if (starts.length === 0) throw new InputError(`${name} has no frame.`);
    return new XyzReader(lines, name, starts);
  }

  get count(): number { return this.starts.length; }

  async table(index: number): Promise<FrameTable> {
    const start = this.starts[index];
    const name = `${this.name}, frame ${index}`;
    const comment = this.lines[start + 1];
    const names = namesOf(valueOf(comment, 'Properties='), name);
    const rows = this.lines.slice(start + 2, start + 2 + Number(this.lines[start])).map(splitAtBlanks);
    const short = rows.findIndex((cells) => cells.length < names.length);
    if (short >= 0) {
      throw new InputError(`${this.name}, line ${start + 3 + short}: ${rows[short].length} of ${names.length} columns: ${names.join(', ')}.`);
    }
    const time = valueOf(comment, 'Time=');
    return {
      names, columnCount: names.length, rows: new TextRows(rows, name), index, name,
      time: time !== '' && Number.isFinite(Number(time)) ? Number(time) : null, box: boxOf(comment),
    };
  }
}
