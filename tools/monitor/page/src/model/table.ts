/** A bounded table of numbers against sim time, in typed arrays: one row an instant, one column a quantity. */

/** How many rows a table begins with; it doubles until it has its full capacity. */
const FIRST_ROWS = 256;

/**
 * Rows in ascending order of time. Once `capacity` rows are there, a new one takes the place of the oldest, so that a
 * page that stays open for days needs no more memory than after its first minutes. Columns are added by name at any
 * time; rows from before have NaN there.
 */
export class Table {
  private readonly names: string[] = [];
  private readonly indices = new Map<string, number>();
  private readonly groups = new Map<string, number>();
  private columns: Float64Array[] = [];
  private times: Float64Array;
  private begin = 0;
  private rows = 0;

  /** @param capacity rows that are kept at most, at least 2. */
  constructor(readonly capacity: number) {
    this.times = new Float64Array(Math.min(FIRST_ROWS, capacity));
  }

  get length(): number {
    return this.rows;
  }

  get columnNames(): readonly string[] {
    return this.names;
  }

  /** The index of a column, which is added if there is none of that name. */
  column(name: string): number {
    let index = this.indices.get(name);
    if (index === undefined) {
      index = this.names.length;
      this.indices.set(name, index);
      this.names.push(name);
      this.columns.push(new Float64Array(this.times.length).fill(NaN));
    }
    return index;
  }

  /**
   * The index of the first of several columns that lie behind each other, named by a thing and a suffix each, which are added
   * if there are none. A thing has the same suffixes each time: thousands of values an instant are found by one look-up a thing.
   */
  columnsOf(thing: string, suffixes: readonly string[]): number {
    let first = this.groups.get(thing);
    if (first === undefined) {
      [first] = suffixes.map((suffix) => this.column(thing + suffix));
      this.groups.set(thing, first);
    }
    return first;
  }

  /** The index of a column; -1 if there is none of that name. */
  find(name: string): number {
    return this.indices.get(name) ?? -1;
  }

  /**
   * Appends a row, or goes on with the last one if that has the same time. Rows at or after `time` that are there
   * already are dropped if time steps back: a log that was wound back is shown anew.
   */
  row(time: number): void {
    if (this.rows > 0 && time <= this.endTime) {
      if (time === this.endTime) return;
      this.rows = this.lowerBound(time);
    }
    if (this.rows === this.times.length && this.rows < this.capacity) this.grow();
    if (this.rows === this.capacity) {
      this.begin = (this.begin + 1) % this.times.length;
    } else {
      this.rows++;
    }
    const at = this.physical(this.rows - 1);
    this.times[at] = time;
    for (const column of this.columns) column[at] = NaN;
  }

  /** Sets a value of the last row. */
  set(column: number, value: number): void {
    this.columns[column][this.physical(this.rows - 1)] = value;
  }

  /** Time of a row; rows count from 0, the oldest. */
  time(row: number): number {
    return this.times[this.physical(row)];
  }

  value(column: number, row: number): number {
    return this.columns[column][this.physical(row)];
  }

  /** Time of the oldest row; NaN if there is none. */
  get beginTime(): number {
    return this.rows ? this.time(0) : NaN;
  }

  /** Time of the newest row; NaN if there is none. */
  get endTime(): number {
    return this.rows ? this.time(this.rows - 1) : NaN;
  }

  /** The first row whose time is not before `time`; `length` if all are. */
  lowerBound(time: number): number {
    let low = 0;
    let high = this.rows;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time(middle) < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** The last row at or before `time`; -1 if all are later. */
  rowAt(time: number): number {
    const row = this.lowerBound(time);
    return row < this.rows && this.time(row) === time ? row : row - 1;
  }

  /** Appends the rows of another table before `until`; columns that are missing here are added. */
  append(other: Table, until: number): void {
    const columns = other.names.map((name) => this.column(name));
    for (let row = 0; row < other.length && other.time(row) < until; row++) {
      this.row(other.time(row));
      columns.forEach((column, i) => this.set(column, other.value(i, row)));
    }
  }

  clear(): void {
    this.begin = 0;
    this.rows = 0;
  }

  /** Bytes that its arrays take. */
  get bytes(): number {
    return this.times.byteLength * (1 + this.columns.length);
  }

  private physical(row: number): number {
    const at = this.begin + row;
    return at < this.times.length ? at : at - this.times.length;
  }

  private grow(): void {
    const size = Math.min(this.capacity, this.times.length * 2);
    const enlarge = (old: Float64Array): Float64Array => {
      const larger = new Float64Array(size).fill(NaN);
      for (let row = 0; row < this.rows; row++) larger[row] = old[this.physical(row)];
      return larger;
    };
    this.columns = this.columns.map(enlarge);
    this.times = enlarge(this.times);
    this.begin = 0;
  }
}
