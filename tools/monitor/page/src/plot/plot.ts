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
const TOP = 8;
const BOTTOM = 20;

export class Plot {
  private readonly context: CanvasRenderingContext2D;
  private range: [number, number] = [0, 1];
  private width = 0;
  private height = 0;
  private from = 0;
  private to = 1;
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

  /**
   * Draws all.
   * @param from, to the window of time, seconds.
   * @param cursor the instant that is shown; @param hover one that the pointer is over, NaN without.
   * @param marks times to be marked, of faults for one.
   */
  draw(
    lines: readonly PlotLine[],
    from: number,
    to: number,
    cursor: number,
    hover: number,
    marks: readonly number[],
    theme: PlotTheme,
  ): void {
    this.fit();
    this.from = from;
    this.to = to;
    const context = this.context;
    context.clearRect(0, 0, this.width, this.height);
    const buckets = Math.max(1, Math.floor(this.width - LEFT - RIGHT));
    const polylines = lines.map((line) => decimate(line.series, from, to, buckets));
    this.drawnPoints = polylines.reduce((n, p) => n + p.times.length, 0);
    this.chooseRange(lines, polylines);
    this.drawAxes(theme);
    context.save();
    context.beginPath();
    context.rect(LEFT, TOP - 2, this.width - LEFT - RIGHT, this.height - TOP - BOTTOM + 4);
    context.clip();
    for (const mark of marks) this.drawVertical(mark, theme.mark, [2, 3]);
    lines.forEach((line, i) => this.drawLine(line, polylines[i]));
    context.restore();
    if (!Number.isNaN(hover)) this.drawVertical(hover, theme.text, [1, 2]);
    this.drawVertical(cursor, theme.cursor, []);
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

  private drawAxes(theme: PlotTheme): void {
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

  private drawLine(line: PlotLine, polyline: Polyline): void {
    const context = this.context;
    context.strokeStyle = line.colour;
    context.lineWidth = 1.6;
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
