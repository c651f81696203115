/** Makes a long series drawable: for every pixel column its first, lowest, highest and last value. */

/** What of a series is read: rows in ascending order of time. */
export interface Series {
  length: number;
  time(row: number): number;
  value(row: number): number;
  lowerBound(time: number): number;
}

/** A polyline; NaN in `values` is a gap. */
export interface Polyline {
  times: number[];
  values: number[];
}

/**
 * The polyline of a series between two times, with at most four points in each of `buckets` equal parts of the time, so
 * that no peak is lost however many rows there are. One row on either side of the window is included, so that the line
 * goes on to the edge.
 */
export function decimate(series: Series, from: number, to: number, buckets: number): Polyline {
  const line: Polyline = { times: [], values: [] };
  const first = Math.max(0, series.lowerBound(from) - 1);
  const last = Math.min(series.length - 1, series.lowerBound(to));
  if (last < first) return line;
  const push = (row: number): void => {
    line.times.push(series.time(row));
    line.values.push(series.value(row));
  };
  if (last - first + 1 <= buckets * 4) {
    for (let row = first; row <= last; row++) push(row);
    return line;
  }
  const width = (to - from) / buckets;
  let row = first;
  while (row <= last) {
    const bucket = Math.floor((series.time(row) - from) / width);
    const end = from + (bucket + 1) * width;
    let low = -1;
    let high = -1;
    const begin = row;
    for (; row <= last && (series.time(row) < end || row === begin); row++) {
      const value = series.value(row);
      if (Number.isNaN(value)) continue;
      if (low < 0 || value < series.value(low)) low = row;
      if (high < 0 || value > series.value(high)) high = row;
    }
    const rows = new Set([begin, Math.min(low, high), Math.max(low, high), row - 1]);
    rows.delete(-1);
    for (const r of [...rows].sort((a, b) => a - b)) push(r);
  }
  return line;
}

/** Lowest and highest value of a polyline; null if it has none. */
export function valueRange(values: readonly number[]): [number, number] | null {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : null;
}
