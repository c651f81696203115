/** Quantities that follow from others: rates, differences, signs, speeds. Each is a series like those of tables. */

import type { Series } from '../plot/decimate.ts';

/** The same rows with other values. */
export function mapped(of: Series, value: (row: number) => number): Series {
  return {
    get length() {
      return of.length;
    },
    time: (row) => of.time(row),
    lowerBound: (time) => of.lowerBound(time),
    value,
  };
}

/** By how much it changes in a second: between the rows before and after, at the ends between the last two. */
export function rateOf(of: Series): Series {
  return mapped(of, (row) => {
    const before = Math.max(0, row - 1);
    const after = Math.min(of.length - 1, row + 1);
    return (of.value(after) - of.value(before)) / (of.time(after) - of.time(before));
  });
}

/** The length of the vector of rates of its components, which have the same rows. */
export function speedOf(components: readonly Series[]): Series {
  const rates = components.map(rateOf);
  return mapped(components[0], (row) => Math.hypot(...rates.map((rate) => rate.value(row))));
}

/** a − b where both have a row of one time; NaN elsewhere. */
export function differenceOf(a: Series, b: Series): Series {
  return mapped(a, (row) => {
    const time = a.time(row);
    const other = b.lowerBound(time - 1e-6);
    return other < b.length && Math.abs(b.time(other) - time) < 1e-6 ? a.value(row) - b.value(other) : NaN;
  });
}
