/** Round numbers for the axes of a plot. */

/** The distance of round numbers (1, 2 or 5 times a power of ten) of which at most `count` lie in `span`. */
export function niceStep(span: number, count: number): number {
  const rough = span / Math.max(1, count);
  const power = 10 ** Math.floor(Math.log10(rough));
  for (const factor of [1, 2, 5]) {
    if (factor * power >= rough * 0.999) return factor * power;
  }
  return 10 * power;
}

/** Round numbers from `low` to `high`, at most about `count`. */
export function niceTicks(low: number, high: number, count: number): number[] {
  if (!(high > low)) return [low];
  const step = niceStep(high - low, count);
  const ticks: number[] = [];
  // Adding 0 makes -0 a 0.
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; i++) ticks.push(i * step + 0);
  return ticks;
}

/** A tick's text, with the decimals that its distance to the next one asks for. */
export function tickText(value: number, step: number): string {
  if (value !== 0 && (Math.abs(value) >= 1e6 || step < 1e-5)) return value.toExponential(step > 0 ? 1 : 2);
  const decimals = Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9)));
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? (0).toFixed(decimals) : text;
}

/** A value beside a plot whose ticks lie `step` apart: always with the same decimals, so that nothing jumps. */
export function fixedText(value: number, step: number): string {
  if (Number.isNaN(value)) return '–';
  if (Math.abs(value) >= 1e6 || step < 1e-5) return value.toExponential(2);
  const decimals = Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(step) + 1e-9)));
  const text = value.toFixed(decimals);
  // What rounds to nothing has no sign.
  return Number(text) === 0 ? (0).toFixed(decimals) : text;
}

/** A value for people, four significant digits. */
export function valueText(value: number): string {
  if (Number.isNaN(value)) return '–';
  const size = Math.abs(value);
  // Rounding errors of doubles are no news.
  if (size < 1e-11) return '0';
  if (size >= 1e6 || size < 1e-4) return value.toExponential(2);
  return value.toPrecision(4);
}

/** Sim time, seconds, as minutes and seconds: 1:23.46. */
export function timeText(seconds: number, decimals = 2): string {
  if (Number.isNaN(seconds)) return '–';
  const sign = seconds < 0 ? '−' : '';
  const size = Math.abs(seconds);
  const minutes = Math.floor(Number(size.toFixed(decimals)) / 60);
  const rest = Math.abs(size - minutes * 60).toFixed(decimals);
  return `${sign}${minutes}:${rest.padStart(decimals ? decimals + 3 : 2, '0')}`;
}
