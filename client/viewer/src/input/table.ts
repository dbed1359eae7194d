// Text tables with the rules of client/input/base/text_table.h.
import { InputError } from './source';

export interface Table {
  /** Empty if the columns have no names. */
  names: string[];
  columnCount: number;
  rows: string[][];
}

const isComment = (line: string) => line.startsWith('#') || line.startsWith('%');
const isNumber = (cell: string) => cell !== '' && !Number.isNaN(Number(cell)) ||
  /^[+-]?nan$/i.test(cell);

export const splitAtBlanks = (line: string) => line.split(/[ \t]+/).filter((cell) => cell !== '');

function unquoted(cell: string): string {
  const bare = cell.trim();
  return bare.length >= 2 && bare.startsWith('"') && bare.endsWith('"')
    ? bare.slice(1, -1).trim() : bare;
}

/** Splits a line. Separators within quotes do not count. */
function splitAt(line: string, separator: string): string[] {
  const cells = line.includes('"')
    ? line.match(new RegExp(`("[^"]*"|[^${separator}])+|(?<=${separator})(?=${separator})`, 'g')) ?? []
    : line.split(separator);
  const bare = cells.map(unquoted);
  if (bare.length > 1 && bare[bare.length - 1] === '') bare.pop();
  return bare;
}

function splitter(line: string): (line: string) => string[] {
  if (!splitAtBlanks(line).every(isNumber)) {
    for (const separator of [';', '\t', ',']) {
      if (line.includes(separator)) return (other) => splitAt(other, separator);
    }
  }
  return (other) => splitAtBlanks(other).map(unquoted);
}

/** Parses a text table. Throws InputError if it is empty, or if a row has fewer cells than the first line. */
export function parseTable(text: string, name: string): Table {
  const lines = text.split(/\r?\n|\r/);
  const first = lines.findIndex((line) => line.trim() !== '' && !isComment(line.trim()));
  if (first < 0) {
    throw new InputError(`${name} is empty. A frame without particles is a header without rows.`);
  }
  const split = splitter(lines[first]);
  const head = split(lines[first]);
  const named = !head.every(isNumber);
  let names = named ? head : [];
  if (!named && first > 0) {
    const comment = splitAtBlanks(lines[first - 1].trim().replace(/^[#%]/, '').replaceAll(',', ' '));
    if (comment.length === head.length && !comment.every(isNumber)) names = comment;
  }
  const rows: string[][] = [];
  for (let k = named ? first + 1 : first; k < lines.length; ++k) {
    const line = lines[k];
    if (line.trim() === '' || isComment(line.trim())) continue;
    const cells = split(line);
    if (cells.length < head.length) {
      throw new InputError(`${name}, line ${k + 1}: ${cells.length} cells, but the first row has ` +
                           `${head.length}. The file may be truncated.`);
    }
    rows.push(cells);
  }
  return { names, columnCount: head.length, rows };
}
