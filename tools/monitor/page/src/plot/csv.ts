/** The lines of a plot as a table of comma-separated values. */

import type { Series } from './decimate.ts';

/** A column of the table; values are multiplied by `scale`. */
export interface CsvColumn {
  name: string;
  unit: string;
  series: Series;
  scale: number;
}

function quoted(text: string): string {
  return /[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text;
}

/** All rows between two times (seconds), one an instant that any of the columns has; where one has none its cell is empty. */
export function csvOf(columns: readonly CsvColumn[], from: number, to: number): string {
  const rows = new Map<number, string[]>();
  columns.forEach(({ series, scale }, i) => {
    for (let row = series.lowerBound(from); row < series.length && series.time(row) <= to; row++) {
      // Times of one tick are equal but for rounding.
      const time = Math.round(series.time(row) * 1e6);
      const cells = rows.get(time) ?? columns.map(() => '');
      const value = series.value(row) * scale;
      if (!Number.isNaN(value)) cells[i] = String(value);
      rows.set(time, cells);
    }
  });
  const head = ['time (s)', ...columns.map(({ name, unit }) => quoted(unit ? `${name} (${unit})` : name))];
  const lines = [...rows].sort(([a], [b]) => a - b).map(([time, cells]) => [String(time / 1e6), ...cells]);
  return [head, ...lines].map((cells) => `${cells.join(',')}\n`).join('');
}
