import { TextRows } from './rows';
import { InputError } from './source';
import { parseTable } from './table';
import type { FrameTable, TableReader } from './table_source';
import { textOf } from './text_file';

/** Times of frames by index. The table has the columns frame and t (or time), or one column. */
export function parseTimes(text: string, name: string): Map<number, number> {
  const table = parseTable(text, name);
  const names = table.names.map((column) => column.toLowerCase());
  const timeAt = names.length === 0 && table.columnCount === 1 ? 0
    : Math.max(names.indexOf('t'), names.indexOf('time'));
  const frameAt = names.indexOf('frame');
  if (timeAt < 0 || (frameAt < 0 && table.columnCount > 1)) {
    throw new InputError(`${name} has no times. It must have the columns frame,t or a single column.`);
  }
  return new Map(table.rows.map((cells, k) =>
    [frameAt < 0 ? k : Number(cells[frameAt]), Number(cells[timeAt])]));
}

/** A CSV file: one frame. */
export class CsvReader implements TableReader {
  readonly count = 1;

  constructor(private readonly file: File) {}

  async table(index: number): Promise<FrameTable> {
    const { name } = this.file;
    const { names, columnCount, rows } = parseTable(await textOf(this.file), name);
    return { names, columnCount, rows: new TextRows(rows, name), time: null, index, name };
  }
}
