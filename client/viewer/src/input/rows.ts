// The rows of a frame: particles with columns of numbers or text.
import { FieldError, type Condition } from './options';
import { InputError } from './source';

export interface Rows {
  readonly count: number;
  /** Numbers of a column. Throws InputError if a cell is text. */
  numbers(column: number): Float64Array;
  /** Numbers of a column; NaN for text. */
  values(column: number): Float64Array;
  /** Ids; null if one is no whole number from 0. */
  ids(column: number): BigUint64Array | null;
  /** Distinct values of a column as text; null if there are more than `limit`. */
  distinct(column: number, limit: number): string[] | null;
  /** The rows that fulfil all conditions. */
  where(conditions: readonly { column: number; condition: Condition }[]): Rows;
}

const isNan = (cell: string) => /^[+-]?nan$/i.test(cell);
const numberOf = (cell: string) => cell === '' ? NaN : Number(cell);

/** Rows of a text table. `name`: for errors. */
export class TextRows implements Rows {
  constructor(private readonly rows: readonly string[][], private readonly name: string) {}

  get count(): number { return this.rows.length; }

  numbers(column: number): Float64Array {
    const values = this.values(column);
    values.forEach((value, row) => {
      const cell = this.rows[row][column];
      if (Number.isNaN(value) && !isNan(cell)) {
        throw new InputError(`${this.name}, row ${row + 1}: '${cell}' is not a number.`);
      }
    });
    return values;
  }

  values(column: number): Float64Array {
    return Float64Array.from(this.rows, (cells) => numberOf(cells[column]));
  }

  ids(column: number): BigUint64Array | null {
    const ids = new BigUint64Array(this.rows.length);
    for (const [row, cells] of this.rows.entries()) {
      if (!/^\d+(\.0*)?$/.test(cells[column])) return null;
      ids[row] = BigInt(cells[column].split('.')[0]);
    }
    return ids;
  }

  distinct(column: number, limit: number): string[] | null {
    const seen = new Set<string>();
    for (const cells of this.rows) {
      seen.add(cells[column]);
      if (seen.size > limit) return null;
    }
    return [...seen];
  }

  where(conditions: readonly { column: number; condition: Condition }[]): Rows {
    if (conditions.length === 0) return this;
    const holds = (cell: string, { text, number }: Condition) => cell === text || numberOf(cell) === number;
    return new TextRows(this.rows.filter((cells) =>
      conditions.every(({ column, condition }) => holds(cells[column], condition))), this.name);
  }
}

/** A column of a binary table. */
export interface NumberColumn {
  number(row: number): number;
  /** Null if the element is no whole number from 0. */
  id(row: number): bigint | null;
}

/** Rows of a binary table. `kept`: the rows to use; null: all. */
export class NumberRows implements Rows {
  constructor(private readonly columns: readonly NumberColumn[], private readonly all: number,
              private readonly kept: Uint32Array | null = null) {}

  get count(): number { return this.kept ? this.kept.length : this.all; }

  numbers(column: number): Float64Array { return this.values(column); }

  values(column: number): Float64Array {
    const values = new Float64Array(this.count);
    for (let k = 0; k < values.length; ++k) values[k] = this.columns[column].number(this.row(k));
    return values;
  }

  ids(column: number): BigUint64Array | null {
    const ids = new BigUint64Array(this.count);
    for (let k = 0; k < ids.length; ++k) {
      const id = this.columns[column].id(this.row(k));
      if (id === null) return null;
      ids[k] = id;
    }
    return ids;
  }

  distinct(column: number, limit: number): string[] | null {
    const seen = new Set<number>();
    for (let k = 0; k < this.count; ++k) {
      seen.add(this.columns[column].number(this.row(k)));
      if (seen.size > limit) return null;
    }
    return [...seen].map(String);
  }

  where(conditions: readonly { column: number; condition: Condition }[]): Rows {
    if (conditions.length === 0) return this;
    for (const { condition } of conditions) {
      if (Number.isNaN(condition.number)) {
        throw new FieldError('select', `The column ${condition.column} has numbers, so '${condition.text}' cannot be in it.`);
      }
    }
    const kept = Uint32Array.from({ length: this.count }, (_, k) => this.row(k)).filter((row) =>
      conditions.every(({ column, condition }) => this.columns[column].number(row) === condition.number));
    return new NumberRows(this.columns, this.all, kept);
  }

  private row(k: number): number { return this.kept ? this.kept[k] : k; }
}
