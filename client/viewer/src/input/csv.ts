import type { Particles } from '../protocol/particles';
import { planNamedColumns, planUnnamedColumns, type ColumnPlan } from './columns';
import { particlesOf } from './particles';
import { InputError, type FrameSource } from './source';
import { parseTable } from './table';
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

/** CSV files, one frame each. */
export class CsvSource implements FrameSource {
  readonly spacing = null;

  private constructor(readonly title: string, private readonly files: File[],
                      private readonly times: Map<number, number>, readonly scalars: string[]) {}

  /** Reads the first frame, whose scalars all frames have. Throws InputError. */
  static async open(files: File[], timesFile: File | null, title: string): Promise<CsvSource> {
    const times = timesFile ? parseTimes(await textOf(timesFile), timesFile.name)
      : new Map<number, number>();
    const source = new CsvSource(title, files, times, []);
    const first = await source.frame(0);
    source.scalars.push(...(first.scalars ?? []).map(({ name }) => name));
    return source;
  }

  get count(): number { return this.files.length; }

  async frame(index: number): Promise<Particles> {
    const file = this.files[index];
    const table = parseTable(await textOf(file), file.name);
    let plan: ColumnPlan;
    try {
      plan = table.names.length > 0 ? planNamedColumns(table.names)
        : planUnnamedColumns(table.columnCount);
    } catch (error) {
      throw new InputError(`${file.name}: ${(error as Error).message}`);
    }
    return particlesOf(table.rows, plan, this.times.get(index) ?? null, index, file.name);
  }
}
