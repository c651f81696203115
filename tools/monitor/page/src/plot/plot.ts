/**
 * One plot on a canvas: lines of several series against sim time, with a cursor at the instant that is shown. Why it is
 * drawn here and not by uPlot: docs/libraries.md.
 */

import { decimate, valueRange, type Polyline, type Series } from './decimate.ts';
import { niceStep, niceTicks, tickText, timeText } from './ticks.ts';

/** A line to draw. */
export interface PlotLine {
  series: Series;
  colour: string;
  /** What values are multiplied by for display. */
  scale: number;
  dashed: boolean;
  /** Wider and paler, so that a dashed line over it can be seen. */
  under: boolean;
}

/** What a plot shows. */
export interface PlotContent {
  lines: readonly PlotLine[];
  /** The window of time, seconds. */
  from: number;
  to: number;
  /** The instant that is shown, and one that the pointer is over, NaN without. */
  cursor: number;
  hover: number;
  /** Times to be marked, of faults for one. */
  marks: readonly number[];
  /** A stretch of time that is being chosen; null without. */
  chosen: [number, number] | null;
  /** What stands over the axis of values. */
  unit: string;
  /** The line that is drawn wider; -1 for none. */
  selected: number;
}

/** Colours of the parts of a plot that are not lines. */
export interface PlotTheme {
  text: string;
  grid: string;
  cursor: string;
  mark: string;
}

/** Room for the axes, CSS pixels. */
const LEFT = 54;
const RIGHT = 10;
const TOP = 16;
const BOTTOM = 20;
/** How near a pointer must be to a line to mean it, CSS pixels. */
const NEAR = 10;

export class Plot {
  private readonly context: CanvasRenderingContext2D;
  private range: [number, number] = [0, 1];
  private width = 0;
  private height = 0;
  private from = 0;
  private to = 1;
  /** How far the ticks of values lie apart. */
  step = 1;
  /** Points that were drawn with the last call, for measurements. */
  drawnPoints = 0;

  constructor(readonly canvas: HTMLCanvasElement) {
    // Kept in memory: where a graphics card is emulated, long lines take it several times as long as the processor.
    const context = canvas.getContext('2d', { willReadFrequently: true });
    if (!context) throw new Error('The browser has no 2D canvas.');
    this.context = context;
  }

  /** The time under a place on the canvas, CSS pixels from its left edge; null beside the plot. */
  timeAt(x: number): number | null {
    const share = (x - LEFT) / (this.width - LEFT - RIGHT);
    return share >= 0 && share <= 1 ? this.from + share * (this.to - this.from) : null;
  }

  /** The time under a place, also beside the plot, where it is that of its edge. */
  clampedTimeAt(x: number): number {
    const share = (x - LEFT) / Math.max(1, this.width - LEFT - RIGHT);
    return this.from + Math.min(1, Math.max(0, share)) * (this.to - this.from);
  }

  /** The line under a place on the canvas, by its index in what was drawn; -1 for none. */
  lineAt(x: number, y: number, lines: readonly PlotLine[]): number {
    const time = this.timeAt(x);
    if (time === null) return -1;
    const distances = lines.map((line) => Math.abs(this.y(valueAt(line.series, time) * line.scale) - y));
    const nearest = distances.reduce((best, d, i) => (d < (distances[best] ?? Infinity) ? i : best), -1);
    return nearest >= 0 && distances[nearest] <= NEAR ? nearest : -1;
  }

  /** The seconds that so many CSS pixels stand for. */
  secondsOf(pixels: number): number {
    return (pixels / Math.max(1, this.width - LEFT - RIGHT)) * (this.to - this.from);
  }

  draw(content: PlotContent, theme: PlotTheme): void {
    const { lines, from, to, cursor, hover, marks } = content;
    this.fit();
    this.from = from;
    this.to = to;
    const context = this.context;
    context.clearRect(0, 0, this.width, this.height);
    const buckets = Math.max(1, Math.floor(this.width - LEFT - RIGHT));
    const polylines = lines.map((line) => decimate(line.series, from, to, buckets));
    this.drawnPoints = polylines.reduce((n, p) => n + p.times.length, 0);
    this.chooseRange(lines, polylines);
    this.drawAxes(content, theme);
    context.save();
    context.beginPath();
    context.rect(LEFT, TOP - 2, this.width - LEFT - RIGHT, this.height - TOP - BOTTOM + 4);
    context.clip();
    for (const mark of marks) this.drawVertical(mark, theme.mark, [2, 3]);
    lines.forEach((line, i) => this.drawLine(line, polylines[i], i === content.selected));
    context.restore();
    if (content.chosen) this.drawChosen(content.chosen, theme);
    this.drawVertical(cursor, theme.cursor, []);
    if (!Number.isNaN(hover)) this.drawHover(hover, lines, theme);
  }

  /** The canvas has as many pixels as the screen shows of it. */
  private fit(): void {
    const ratio = window.devicePixelRatio || 1;
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    const w = Math.round(this.width * ratio);
    const h = Math.round(this.height * ratio);
    if (this.canvas.width !== w || this.canvas.height !== h) {
      this.canvas.width = w;
      this.canvas.height = h;
    }
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  private chooseRange(lines: readonly PlotLine[], polylines: readonly Polyline[]): void {
    let low = Infinity;
    let high = -Infinity;
    polylines.forEach((polyline, i) => {
      const range = valueRange(polyline.values);
      if (!range) return;
      const [a, b] = range.map((v) => v * lines[i].scale);
      low = Math.min(low, a, b);
      high = Math.max(high, a, b);
    });
    if (!(low <= high)) [low, high] = [0, 1];
    // A line that does not change lies in the middle; rounding errors are not blown up to the plot's height.
    const least = Math.max(1e-9, 1e-6 * Math.max(Math.abs(low), Math.abs(high)));
    if (high - low < least) {
      const half = Math.max(Math.abs(low) * 0.1, 0.001);
      [low, high] = [low - half, high + half];
    }
    const room = (high - low) * 0.06;
    this.range = [low - room, high + room];
  }

  private x(time: number): number {
    return LEFT + ((time - this.from) / (this.to - this.from)) * (this.width - LEFT - RIGHT);
  }

  private y(value: number): number {
    const [low, high] = this.range;
    return TOP + ((high - value) / (high - low)) * (this.height - TOP - BOTTOM);
  }

  private drawAxes({ unit }: PlotContent, theme: PlotTheme): void {
    const context = this.context;
    context.font = '11px system-ui, sans-serif';
    context.lineWidth = 1;
    context.strokeStyle = theme.grid;
    context.fillStyle = theme.text;
    context.textAlign = 'right';
    context.textBaseline = 'middle';
    const [low, high] = this.range;
    const rows = Math.max(3, Math.floor((this.height - TOP - BOTTOM) / 30));
    const step = niceStep(high - low, rows);
    this.step = step;
    if (unit) context.fillText(unit, LEFT - 6, 6);
    context.beginPath();
    for (const tick of niceTicks(low, high, rows)) {
      const y = Math.round(this.y(tick)) + 0.5;
      context.moveTo(LEFT, y);
      context.lineTo(this.width - RIGHT, y);
      context.fillText(tickText(tick, step), LEFT - 6, y);
    }
    context.textAlign = 'center';
    context.textBaseline = 'top';
    const columns = Math.max(2, Math.floor((this.width - LEFT - RIGHT) / 80));
    const timeStep = niceStep(this.to - this.from, columns);
    for (const tick of niceTicks(this.from, this.to, columns)) {
      const x = Math.round(this.x(tick)) + 0.5;
      context.moveTo(x, TOP);
      context.lineTo(x, this.height - BOTTOM);
      context.fillText(
        timeText(tick, timeStep < 1 ? 1 : 0),
        Math.min(Math.max(x, LEFT + 12), this.width - RIGHT - 12),
        this.height - BOTTOM + 5,
      );
    }
    context.stroke();
  }

  /** The stretch of time that a drag has chosen so far. */
  private drawChosen([from, to]: [number, number], theme: PlotTheme): void {
    const context = this.context;
    context.globalAlpha = 0.18;
    context.fillStyle = theme.cursor;
    context.fillRect(this.x(from), TOP, this.x(to) - this.x(from), this.height - TOP - BOTTOM);
    context.globalAlpha = 1;
  }

  /** The time under the pointer, with a dot on every line. */
  private drawHover(time: number, lines: readonly PlotLine[], theme: PlotTheme): void {
    const context = this.context;
    this.drawVertical(time, theme.text, [1, 2]);
    for (const line of lines) {
      const y = this.y(valueAt(line.series, time) * line.scale);
      if (Number.isNaN(y)) continue;
      context.fillStyle = line.colour;
      context.beginPath();
      context.arc(this.x(time), y, 3, 0, 2 * Math.PI);
      context.fill();
    }
    const x = this.x(time);
    const right = x > this.width / 2;
    context.fillStyle = theme.text;
    context.textAlign = right ? 'right' : 'left';
    context.textBaseline = 'top';
    context.fillText(timeText(time), x + (right ? -4 : 4), 1);
  }

  private drawLine(line: PlotLine, polyline: Polyline, selected: boolean): void {
    const context = this.context;
    context.strokeStyle = line.colour;
    context.lineWidth = selected || line.under ? 3 : 1.6;
    context.globalAlpha = line.under ? 0.5 : 1;
    context.lineJoin = 'round';
    context.setLineDash(line.dashed ? [5, 3] : []);
    context.beginPath();
    let pen = false;
    for (let i = 0; i < polyline.times.length; i++) {
      const value = polyline.values[i];
      if (Number.isNaN(value)) {
        pen = false;
        continue;
      }
      const x = this.x(polyline.times[i]);
      const y = this.y(value * line.scale);
      if (pen) context.lineTo(x, y);
      else context.moveTo(x, y);
      pen = true;
    }
    context.stroke();
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  private drawVertical(time: number, colour: string, dash: number[]): void {
    if (!(time >= this.from && time <= this.to)) return;
    const context = this.context;
    const x = Math.round(this.x(time)) + 0.5;
    context.strokeStyle = colour;
    context.lineWidth = 1;
    context.setLineDash(dash);
    context.beginPath();
    context.moveTo(x, TOP - 2);
    context.lineTo(x, this.height - BOTTOM);
    context.stroke();
    context.setLineDash([]);
  }
}

/** The value of the last row at or before `time`; NaN without one. */
export function valueAt(series: Series, time: number): number {
  const row = series.lowerBound(time + 1e-9) - 1;
  return row >= 0 && row < series.length ? series.value(row) : NaN;
}
