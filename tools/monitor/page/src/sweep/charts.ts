/** What the plots of a sweep show, as options of ECharts. */

import { binned, cellsOf, distinct, isNumeric, valueText, type Series } from './data.ts';

/** As ECharts takes them. */
export type Option = Record<string, unknown>;

/** The colours of the page, which are those of the reader's system. */
export interface Theme {
  text: string;
  dim: string;
  line: string;
  card: string;
  accent: string;
  /** Of what is best. */
  best: string;
  /** From few to much. */
  ramp: string[];
}

export function themeOf(root: Element): Theme {
  const style = getComputedStyle(root);
  const of = (name: string): string => style.getPropertyValue(name).trim();
  const ramp = RAMPS[matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light'];
  return { text: of('--text'), dim: of('--dim'), line: of('--line'), card: of('--card'), accent: of('--a'), best: of('--b'), ramp };
}

/** By brightness, too, for people who do not tell colours apart (viridis); its dark end is lighter on a dark ground. */
const RAMPS = {
  light: ['#440154', '#3b528b', '#21918c', '#5ec962', '#fde725'],
  dark: ['#9a78e0', '#5f8fd9', '#2fb0a8', '#72d26f', '#fde725'],
};

/** An axis of numbers, or of names. */
function axis(series: Series, theme: Theme, named = false): Option {
  const common = {
    name: series.name,
    nameLocation: 'middle',
    nameGap: 28,
    nameTextStyle: { color: theme.text },
    axisLabel: { color: theme.dim, hideOverlap: true },
    axisLine: { lineStyle: { color: theme.line } },
    splitLine: { lineStyle: { color: theme.line } },
  };
  if (isNumeric(series) && !named) return { ...common, type: 'value', scale: true };
  return { ...common, type: 'category', data: distinct(series).map(valueText) };
}

/** A value's place on its axis. */
function placeOf(series: Series): (row: number) => number | null {
  if (isNumeric(series)) return (row) => series.values[row] as number | null;
  const places = new Map(distinct(series).map((value, i) => [value, i]));
  return (row) => places.get(series.values[row]) ?? null;
}

/** The colours of a series below a plot; nothing if all values are one. */
function ramp(series: Series, numbers: readonly number[], theme: Theme, dimension: number): Option | undefined {
  const [low, high] = [Math.min(...numbers), Math.max(...numbers)];
  if (!(low < high)) return undefined;
  return {
    type: 'continuous',
    dimension,
    min: low,
    max: high,
    calculable: true,
    orient: 'horizontal',
    left: 'center',
    bottom: 0,
    itemHeight: 120,
    inRange: { color: theme.ramp },
    formatter: (value: number) => valueText(value),
    textStyle: { color: theme.dim },
    name: series.name,
  };
}

/** Says of a row what a reader points at. */
export type Describe = (row: number) => string;

function base(theme: Theme): Option {
  return {
    animation: false,
    backgroundColor: 'transparent',
    textStyle: { color: theme.text },
    tooltip: {
      backgroundColor: theme.card,
      borderColor: theme.line,
      textStyle: { color: theme.text, fontSize: 12 },
      confine: true,
    },
    grid: { left: 64, right: 24, top: 18, bottom: 104 },
  };
}

/** A point a row. */
export function scatterOption(
  [x, y, colour]: readonly [Series, Series, Series],
  rows: readonly number[],
  theme: Theme,
  describe: Describe,
): Option {
  const [atX, atY, shade] = [placeOf(x), placeOf(y), placeOf(colour)];
  const data = rows.map((row) => [atX(row), atY(row), shade(row), row]);
  const shades = data.map((point) => point[2]).filter((value): value is number => value !== null);
  const common = base(theme);
  return {
    ...common,
    tooltip: {
      ...(common.tooltip as Option),
      formatter: (point: { value: number[] }) => describe(point.value[3]),
    },
    xAxis: axis(x, theme),
    yAxis: { ...axis(y, theme), nameGap: 46 },
    visualMap: ramp(colour, shades, theme, 2),
    series: [{ type: 'scatter', data, symbolSize: rows.length > 2000 ? 4 : 8, itemStyle: { color: theme.accent }, large: false }],
  };
}

/** A point a row of a search, those that its conditions forbid pale, and a line through some of them. */
export function searchOption(
  [x, y]: readonly [Series, Series],
  { allowed, others, line, step }: { allowed: readonly number[]; others: readonly number[]; line: readonly number[]; step: boolean },
  theme: Theme,
  describe: Describe,
): Option {
  const common = base(theme);
  const points = (rows: readonly number[]): unknown[] => rows.map((row) => [x.values[row], y.values[row], row]);
  const symbolSize = allowed.length > 2000 ? 4 : 8;
  return {
    ...common,
    tooltip: {
      ...(common.tooltip as Option),
      formatter: (point: { value: number[] }) => describe(point.value[2]),
    },
    grid: { left: 64, right: 24, top: 18, bottom: 52 },
    xAxis: axis(x, theme),
    yAxis: { ...axis(y, theme), nameGap: 46 },
    series: [
      { type: 'scatter', data: points(others), symbolSize, itemStyle: { color: theme.dim, opacity: 0.35 } },
      { type: 'scatter', data: points(allowed), symbolSize, itemStyle: { color: theme.accent, opacity: 0.6 } },
      {
        type: 'line',
        data: points(line),
        step: step ? 'end' : false,
        symbolSize: 9,
        lineStyle: { color: theme.best, width: 2 },
        itemStyle: { color: theme.best },
      },
    ],
  };
}

/** A cell for each pair of two inputs' values, or parts of their ranges, coloured by the mean of a figure. */
export function heatOption(
  [across, up, value]: readonly [Series, Series, Series],
  rows: readonly number[],
  theme: Theme,
): Option {
  const [x, y] = [binned(across), binned(up)];
  const cells = cellsOf(x, y, value, rows);
  const common = base(theme);
  const names = [distinct(x), distinct(y)];
  return {
    ...common,
    tooltip: {
      ...(common.tooltip as Option),
      formatter: (cell: { value: number[] }) => {
        const [i, j, mean, count] = cell.value;
        const of = count === 1 ? 'one row' : `the mean of ${count} rows`;
        const head = `${x.name} ${valueText(names[0][i])}, ${y.name} ${valueText(names[1][j])}`;
        return escapeText(`${head}: ${value.name} ${valueText(mean)}, ${of}`);
      },
    },
    xAxis: axis(x, theme, true),
    yAxis: { ...axis(y, theme, true), nameGap: 46 },
    visualMap: ramp(value, cells.map((cell) => cell.mean), theme, 2),
    series: [{ type: 'heatmap', data: cells.map((cell) => [cell.x, cell.y, cell.mean, cell.count]), itemStyle: { color: theme.accent } }],
  };
}

/** Room beside the outer axes, pixels. */
const SIDE = 60;

/** A line a row, through an axis for each series; ranges of the axes can be chosen. `width` is that of the plot, pixels. */
export function parallelOption(
  series: readonly Series[],
  colour: Series,
  rows: readonly number[],
  theme: Theme,
  width: number,
): Option {
  const places = [...series, colour].map(placeOf);
  const data = rows.map((row) => [...places.map((place) => place(row)), row]);
  const shades = data.map((line) => line[series.length]).filter((value): value is number => value !== null);
  return {
    ...base(theme),
    tooltip: undefined,
    parallel: { left: SIDE, right: SIDE, top: 48, bottom: 64 },
    parallelAxis: series.map((one, dim) => ({
      dim,
      ...axis(one, theme),
      nameLocation: 'end',
      nameGap: 18,
      nameRotate: undefined,
      nameTextStyle: { color: theme.text, fontSize: 11 },
      // Names stand side by side, and all of one can be read in the table.
      nameTruncate: { maxWidth: Math.min(2 * SIDE, Math.max(30, (width - 2 * SIDE) / Math.max(1, series.length - 1) - 8)) },
      realtime: false,
      areaSelectStyle: { width: 18, color: theme.accent, borderColor: theme.accent, opacity: 0.25 },
    })),
    visualMap: ramp(colour, shades, theme, series.length),
    series: [
      {
        type: 'parallel',
        data,
        lineStyle: { width: rows.length > 300 ? 0.6 : 1.4, opacity: rows.length > 300 ? 0.4 : 0.8, color: theme.accent },
        inactiveOpacity: 0.03,
        activeOpacity: 0.9,
      },
    ],
  };
}

/** Tooltips of ECharts are HTML. */
export function escapeText(text: string): string {
  return text.replace(/[&<>"']/g, (c) => `&#${c.charCodeAt(0)};`);
}
