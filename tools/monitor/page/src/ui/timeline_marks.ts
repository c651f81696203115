/** Marks on the time line: what is loaded, and what happened when, with labels where there is room and all of it under the pointer. */

import type { Run } from '../model/run.ts';
import { timeText } from '../plot/ticks.ts';
import type { Context } from './context.ts';
import { element, fill } from './dom.ts';

/** How near the pointer must be to a mark to mean it, CSS pixels. */
const NEAR = 5;
/** Marks that are told of at once, and characters of a label, at most. */
const TOLD = 4;
const LABEL = 24;
const LABEL_FONT = '10px system-ui, sans-serif';

interface Mark {
  time: number;
  /** What stands on the time line. */
  label: string;
  /** What is told under the pointer. */
  text: string;
  kind: 'fault' | 'event' | 'print';
}

function marksOf(run: Run): Mark[] {
  return [
    ...run.faults.list.map((fault): Mark => {
      const text = `${fault.module}: ${fault.text || fault.name}`;
      return { time: fault.time, label: `fault ${fault.module}`, text, kind: 'fault' };
    }),
    ...run.events.list.map((event): Mark => {
      const text = event.place ? `${event.place.module}: ${event.text}` : event.text;
      return { time: event.time, label: text, text, kind: event.place ? 'print' : 'event' };
    }),
  ];
}

export class TimelineMarks {
  readonly canvas = element('canvas', { class: 'marks', 'aria-hidden': 'true' });
  readonly tip = element('div', { class: 'mark-tip', role: 'tooltip', hidden: true });
  private drawnKey = '';
  private marks: Mark[] = [];
  private span = { begin: NaN, end: NaN };

  /** Follows the pointer over `slider`; a click on a mark shows its instant. */
  constructor(
    private readonly context: Context,
    slider: HTMLElement,
  ) {
    const at = (event: MouseEvent): number => event.clientX - this.canvas.getBoundingClientRect().left;
    slider.addEventListener('pointermove', (event) => this.tell(at(event)));
    slider.addEventListener('pointerleave', () => (this.tip.hidden = true));
    slider.addEventListener('click', (event) => {
      const [mark] = this.under(at(event));
      if (mark) this.context.seek(mark.time);
    });
  }

  draw(span: { begin: number; end: number }, range: { begin: number; end: number }): void {
    const { canvas } = this;
    const { runs } = this.context.session;
    const key = [
      ...[span.begin, span.end, range.begin, range.end],
      canvas.clientWidth,
      document.documentElement.dataset.theme,
      runs.map((run) => run.reportVersion),
    ].join();
    if (key === this.drawnKey) return;
    this.drawnKey = key;
    this.span = span;
    this.marks = runs.flatMap(marksOf).sort((a, b) => a.time - b.time);
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    // Kept in memory, as plots are: of a live run they are drawn ten times a second.
    const context = canvas.getContext('2d', { willReadFrequently: true });
    if (!context || span.end <= span.begin) return;
    context.scale(ratio, ratio);
    const styles = getComputedStyle(canvas);
    const colour = (name: string): string => styles.getPropertyValue(`--${name}`);
    context.fillStyle = colour('loaded');
    context.fillRect(this.x(range.begin), height / 2 - 3, Math.max(1, this.x(range.end) - this.x(range.begin)), 6);
    for (const { time, kind } of this.marks) {
      context.fillStyle = colour(kind === 'fault' ? 'fault' : 'event');
      if (kind === 'fault') context.fillRect(this.x(time), height / 2 - 9, 2, 6);
      else context.fillRect(this.x(time), height / 2 + 4, 1.5, kind === 'print' ? 3 : 6);
    }
    this.drawLabels(context, width, height, colour);
  }

  private x(time: number): number {
    return ((time - this.span.begin) / (this.span.end - this.span.begin)) * this.canvas.clientWidth;
  }

  /** Faults above the track and what else happened below it, as far as the labels do not meet. */
  private drawLabels(
    context: CanvasRenderingContext2D,
    width: number,
    height: number,
    colour: (name: string) => string,
  ): void {
    context.font = LABEL_FONT;
    for (const fault of [true, false]) {
      let free = 0;
      context.fillStyle = colour(fault ? 'fault' : 'text-quiet');
      context.textBaseline = fault ? 'top' : 'bottom';
      for (const mark of this.marks) {
        if (mark.kind === 'print' || (mark.kind === 'fault') !== fault) continue;
        const text = mark.label.length > LABEL ? `${mark.label.slice(0, LABEL - 1)}…` : mark.label;
        const size = context.measureText(text).width;
        const x = Math.min(this.x(mark.time) + 4, width - size);
        if (x < free) continue;
        context.fillText(text, x, fault ? 0 : height);
        free = x + size + 10;
      }
    }
  }

  /** The marks at a place, the nearest first. */
  private under(x: number): Mark[] {
    const distance = (mark: Mark): number => Math.abs(this.x(mark.time) - x);
    return this.marks.filter((mark) => distance(mark) <= NEAR).sort((a, b) => distance(a) - distance(b));
  }

  private tell(x: number): void {
    const marks = this.under(x);
    this.tip.hidden = !marks.length;
    if (!marks.length) return;
    const lines = marks.slice(0, TOLD).map((mark) =>
      element('div', { class: mark.kind }, element('b', {}, timeText(mark.time)), ` ${mark.text}`),
    );
    const more = marks.length > TOLD && element('div', {}, `and ${marks.length - TOLD} more`);
    fill(this.tip, ...lines, more);
    // Its middle is over the mark, but within the track.
    const half = this.tip.offsetWidth / 2;
    const middle = Math.min(Math.max(x, half), Math.max(half, this.canvas.clientWidth - half));
    this.tip.style.left = `${middle}px`;
  }
}
