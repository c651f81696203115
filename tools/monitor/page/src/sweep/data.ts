/** The rows of a sweep as the page of a report holds them, and what is computed of them. */

export type Value = number | string | boolean | null;

export interface Column {
  name: string;
  kind: 'input' | 'figure';
}

export interface Row {
  /** From 1. */
  row: number;
  /** "done", "failed", "crashed", "timeout" or "missing". */
  status: string;
  error: string;
  /** The value of the expression by which rows are ranked. */
  goal: Value;
  /** The values of a search's goals, and whether its conditions hold. */
  goals: Value[];
  allowed: boolean;
  /** One a column; null for what the row does not have. */
  values: Value[];
}

/** What a search is for. */
export interface Goal {
  text: string;
  smallest: boolean;
}

export interface Sweep {
  columns: Column[];
  rows: Row[];
  /** The text of that expression, and whether the best rows are those in which it is smallest. */
  goal: string;
  smallest: boolean;
  /** None if the rows are not those of a search. */
  search: Goal[];
  /** The command that runs a row again, up to the row's number. */
  rerun: string;
}

/** A column with its values, the goal among them. */
export interface Series {
  name: string;
  input: boolean;
  values: Value[];
}

/** The rows' own numbers, by which a search is followed, as a series. */
export function placesOf(sweep: Sweep): Series {
  return { name: 'row', input: false, values: sweep.rows.map((row) => row.row) };
}

/** Inputs first, then the goal unless it is a figure itself, then figures. */
export function seriesOf(sweep: Sweep): Series[] {
  const all = sweep.columns.map((column, i) => ({
    name: column.name,
    input: column.kind === 'input',
    values: sweep.rows.map((row) => row.values[i]),
  }));
  const inputs = all.filter((one) => one.input);
  const figures = all.filter((one) => !one.input);
  const goal = { name: sweep.goal, input: false, values: sweep.rows.map((row) => row.goal) };
  return all.some((one) => one.name === sweep.goal) ? [...inputs, ...figures] : [...inputs, goal, ...figures];
}

/** Whether all values that are known are numbers, and there is one. */
export function isNumeric(series: Series): boolean {
  const known = series.values.filter((value) => value !== null);
  return known.length > 0 && known.every((value) => typeof value === 'number');
}

/** The values that come in a series, each once: numbers by size, others in the order in which they come. */
export function distinct(series: Series): Value[] {
  const found = [...new Set(series.values.filter((value) => value !== null))];
  return isNumeric(series) ? found.sort((a, b) => (a as number) - (b as number)) : found;
}

/** A value as people read it. */
export function valueText(value: Value): string {
  if (typeof value === 'number') return Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(5)));
  return value === null ? '–' : String(value);
}

/** Values that a map of cells has on an axis at most. */
const MOST_CELLS = 24;
const BINS = 12;

/** The series itself, or if it has very many numbers, as those that are drawn or searched for, each one's part of their range, by its middle. */
export function binned(series: Series): Series {
  const values = distinct(series);
  if (!isNumeric(series) || values.length <= MOST_CELLS) return series;
  const [low, high] = [values[0] as number, values[values.length - 1] as number];
  const width = (high - low) / BINS;
  const middle = (value: number): number => low + (Math.min(BINS - 1, Math.floor((value - low) / width)) + 0.5) * width;
  return { ...series, values: series.values.map((value) => (value === null ? null : middle(value as number))) };
}

export interface Cell {
  x: number;
  y: number;
  /** The mean of so many rows. */
  mean: number;
  count: number;
}

/** For each pair of values of two series, by their places in `distinct`, the mean of a third in the rows that have them. */
export function cellsOf(x: Series, y: Series, value: Series, rows: readonly number[]): Cell[] {
  const places = (series: Series): Map<Value, number> => new Map(distinct(series).map((one, i) => [one, i]));
  const ofX = places(x);
  const ofY = places(y);
  const cells = new Map<string, Cell>();
  for (const row of rows) {
    const at = [ofX.get(x.values[row]), ofY.get(y.values[row])];
    const number = value.values[row];
    if (at[0] === undefined || at[1] === undefined || typeof number !== 'number') continue;
    const key = `${at[0]} ${at[1]}`;
    const cell = cells.get(key) ?? { x: at[0], y: at[1], mean: 0, count: 0 };
    cell.count++;
    cell.mean += (number - cell.mean) / cell.count;
    cells.set(key, cell);
  }
  return [...cells.values()];
}

/**
 * How much of a figure's variance an input explains, 0 to 1: that of its means over the rows of each value. Those inputs are
 * plotted at first that say most.
 */
export function effectOf(input: Series, figure: Series, rows: readonly number[]): number {
  const whole = { name: '', input: true, values: input.values.map(() => 0) };
  const means = cellsOf(input, whole, figure, rows);
  const numbers = rows.map((row) => figure.values[row]).filter((value): value is number => typeof value === 'number');
  const mean = numbers.reduce((sum, value) => sum + value, 0) / numbers.length;
  const between = means.reduce((sum, cell) => sum + cell.count * (cell.mean - mean) ** 2, 0);
  const all = numbers.reduce((sum, value) => sum + (value - mean) ** 2, 0);
  return all > 0 ? between / all : 0;
}

/** The places of rows in order of a series; what is not known comes last, and equal rows stay as they were. */
export function ordered(series: Series, rows: readonly number[], descending: boolean): number[] {
  const compare = (a: Value, b: Value): number => {
    if (typeof a === 'number' && typeof b === 'number') return a - b;
    return String(a) < String(b) ? -1 : String(a) > String(b) ? 1 : 0;
  };
  return [...rows].sort((p, q) => {
    const [a, b] = [series.values[p], series.values[q]];
    if (a === null || b === null) return Number(a === null) - Number(b === null);
    return descending ? compare(b, a) : compare(a, b);
  });
}

/** The rows of a search that its conditions allow and that have a value for each goal, in the order in which they were tried. */
export function candidatesOf(sweep: Sweep): number[] {
  return sweep.rows.flatMap((row, i) => (row.allowed && row.goals.every((value) => typeof value === 'number') ? [i] : []));
}

/** Of those rows the ones that were better in a goal than all before them. */
export function improvementsOf(sweep: Sweep, goal: number): number[] {
  const sign = sweep.search[goal].smallest ? 1 : -1;
  let best = Infinity;
  return candidatesOf(sweep).filter((row) => {
    const cost = sign * (sweep.rows[row].goals[goal] as number);
    const better = cost < best;
    if (better) best = cost;
    return better;
  });
}

/** Of those rows the ones that no other one is better than in two goals, by the first of these; of equal ones the first. */
export function frontOf(sweep: Sweep, [a, b]: readonly [number, number]): number[] {
  const cost = (row: number, goal: number): number => (sweep.search[goal].smallest ? 1 : -1) * (sweep.rows[row].goals[goal] as number);
  let least = Infinity;
  return candidatesOf(sweep)
    .sort((p, q) => cost(p, a) - cost(q, a) || cost(p, b) - cost(q, b))
    .filter((row) => {
      const better = cost(row, b) < least;
      if (better) least = cost(row, b);
      return better;
    });
}
