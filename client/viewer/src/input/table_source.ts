// Files that hold tables of particles, as frames.
import type { PeriodicBox } from '@proto/v1/reconstruction_pb';
import type { Particles } from '../protocol/particles';
import type { SectionPlane } from '../protocol/sections';
import { type ColumnPlan, namesOfUnnamed, planColumns } from './columns';
import {
  ALL_COLUMNS, checkSpacing, type ColumnRequest, FieldError, type FileFacts, type FileOptions, parseRequest, parseSlices,
  parseSpacing, type SpaceChoice,
} from './options';
import { isInSpace, type ParticleTable, particlesOf, positionsOf } from './particles';
import { parsePeriodic, withOwnBox } from './periodic';
import { InputError, type FrameSource } from './source';
import { middlePlane, spacingOf } from './space';

/** The table of one frame. `names`: of its columns; empty without names. */
export interface FrameTable extends ParticleTable { names: string[]; columnCount: number }

/** Reads tables of one kind. */
export interface TableReader {
  /** Number of frames. */
  readonly count: number;
  /** The table of frame `index`, starting at 0. Throws InputError. */
  table(index: number): Promise<FrameTable>;
}

/** The frames of several readers, one after another. */
export class ReaderChain implements TableReader {
  readonly count: number;

  constructor(private readonly readers: readonly TableReader[]) {
    this.count = readers.reduce((sum, { count }) => sum + count, 0);
  }

  async table(index: number): Promise<FrameTable> {
    let first = 0;
    for (const reader of this.readers) {
      if (index < first + reader.count) return { ...await reader.table(index - first), index };
      first += reader.count;
    }
    throw new InputError(`There is no frame ${index}.`);
  }
}

/** Frames of tables with options. */
export class TableSource implements FrameSource {
  readonly notice = '';
  readonly scalars: string[] = [];
  box?: PeriodicBox;

  private constructor(
    readonly title: string, private readonly reader: TableReader, private readonly times: Map<number, number>,
    private readonly request: ColumnRequest, readonly spacing: number | null,
    private readonly choice: SpaceChoice, private readonly periodic: readonly number[],
  ) {}

  /** Reads the first frame, whose scalars all frames have. Throws InputError, and FieldError for an option. */
  static async open(title: string, reader: TableReader, times: Map<number, number>,
                    options: FileOptions): Promise<TableSource> {
    const spacing = parseSpacing(options.spacing);
    const choice = parseSlices(options.slice);
    const periodic = parsePeriodic(options.periodic, choice.isSurface);
    const source = new TableSource(title, reader, times, parseRequest(options), spacing, choice, periodic);
    const first = await source.frame(0);
    if (first.positions.length === 0 && source.request.conditions.length > 0) {
      throw new FieldError('select', `No particle of the first frame has ${options.select}.`);
    }
    checkSpacing(choice, spacing);
    source.box = first.box;
    source.scalars.push(...(first.scalars ?? []).map(({ name }) => name));
    return source;
  }

  get count(): number { return this.reader.count; }
  get isSurface(): boolean { return this.choice.isSurface; }
  get slices(): readonly SectionPlane[] { return this.choice.slices; }

  async frame(index: number): Promise<Particles> {
    const table = await this.reader.table(index);
    const time = this.times.get(index) ?? table.time;
    const inSpace = this.isSurface || this.slices.length > 0;
    return withOwnBox(particlesOf({ ...table, time }, planOf(table, this.request), inSpace, this.periodic), this.box);
  }
}

function planOf({ names, columnCount, name, place }: FrameTable, request: ColumnRequest): ColumnPlan {
  try {
    const plan = planColumns(names, columnCount, request);
    if (plan.scaled && !place && request.columns.length === 0) {
      throw new FieldError('columns', 'The only positions are fractions of the box of a LAMMPS dump (xs, ys). Name other columns.');
    }
    return plan;
  } catch (error) {
    if (error instanceof FieldError) throw new FieldError(error.field, `${name}: ${error.message}`);
    throw error;
  }
}

/** A column with more distinct values than this is not offered as a filter by the type of particles. */
const MOST_TYPES = 8;

/** Facts of the first frame, for the defaults of the options. Throws InputError if the frame cannot be read. */
export async function factsOf(reader: TableReader): Promise<FileFacts> {
  const table = await reader.table(0);
  const { names, columnCount, rows } = table;
  const facts: FileFacts = {
    spacing: '', columns: '', slice: '', filters: [], hasBox: table.box?.axes.some(Boolean) ?? false,
    names: names.length > 0 ? names : Array.from({ length: columnCount }, (_, k) => String(k + 1)),
  };
  let plan: ColumnPlan;
  try {
    plan = planOf(table, ALL_COLUMNS);
  } catch (error) {
    if (error instanceof FieldError) return facts;
    throw error;
  }
  const shown = names.length > 0 ? names : namesOfUnnamed(columnCount, ALL_COLUMNS).names;
  facts.columns = plan.positions.flatMap((at) => at === null ? [] : [shown[at]]).join(',');
  for (const { name, column } of plan.scalars) {
    const values = rows.count > 2 * MOST_TYPES ? rows.distinct(column, MOST_TYPES) : null;
    if (!values || values.length < 2 || !values.every((value) => /^(\d{1,6}|[A-Za-z]\w*)$/.test(value))) continue;
    facts.filters.push(...values.sort().map((value) => `${name}=${value}`));
  }
  const axes = positionsOf(table, plan);
  if (isInSpace(axes)) {
    facts.slice = middlePlane(axes as Float64Array[]);
    facts.spacing = spacingOf(axes as Float64Array[]);
  }
  return facts;
}
