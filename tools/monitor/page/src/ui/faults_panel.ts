/** Faults of programs, what they print, and what was done to the run, newest first. */

import type { Run } from '../model/run.ts';
import type { Fault, RunEvent, SourcePlace } from '../model/run_data.ts';
import { timeText } from '../plot/ticks.ts';
import { runHeading, type Context, type Panel } from './context.ts';
import { button, element, fill } from './dom.ts';

/** Entries that are shown at most; the rest is counted. */
const SHOWN = 200;

export class FaultsPanel implements Panel {
  readonly element = element('div', { class: 'panel-body' });
  private shown = '';

  constructor(private readonly context: Context) {}

  update(): void {
    const { session, time } = this.context;
    const later = (reports: readonly { time: number }[]): number => reports.filter((r) => r.time > time + 1e-9).length;
    const key = session.runs
      .map(({ name, faults, events }) => [name, faults.total, events.total, later(faults.list), later(events.list)])
      .join();
    if (key === this.shown) return;
    this.shown = key;
    fill(this.element, ...session.runs.flatMap((run) => this.section(run)));
  }

  private section(run: Run): HTMLElement[] {
    const title = runHeading(this.context, run);
    const faults = run.faults.list.slice(-SHOWN).reverse();
    const total = run.faults.total;
    const list = faults.length
      ? element('ol', { class: 'faults' }, ...faults.map((fault) => this.fault(run, fault)))
      : element(
          'p',
          { class: 'empty' },
          'No faults. What goes wrong in a module’s program appears here as it happens, with its line.',
        );
    const more =
      total > faults.length
        ? [element('p', { class: 'quiet' }, `${total - faults.length} earlier ones are not shown.`)]
        : [];
    const events = run.events.list.slice(-SHOWN).reverse();
    return [
      ...title,
      list,
      ...more,
      element('h3', {}, 'What happened'),
      events.length
        ? element('ol', { class: 'events' }, ...events.map((event) => this.event(run, event)))
        : element('p', { class: 'empty' }, 'Nothing yet: what programs print, commands, changes of roles and connections are listed here.'),
    ];
  }

  private time(time: number): HTMLElement {
    return button(timeText(time), () => this.context.seek(time), { class: 'time', title: 'Show this instant' });
  }

  /** What comes after the instant that is shown stands back. */
  private later(time: number): string {
    return time > this.context.time + 1e-9 ? 'later' : '';
  }

  private module(run: Run, module: string): HTMLElement {
    return button(module, () => this.context.select({ run, module }), { class: 'pick', title: 'Select this module' });
  }

  /** The place as a button, with the function's name behind it; an empty text where there is none. */
  private place(run: Run, place: SourcePlace, inside: string): HTMLElement | string {
    const text = place.line ? `${place.file || 'program'}:${place.line}` : place.file;
    if (!text) return '';
    const parts = [text, inside && element('span', { class: 'quiet' }, ` in ${inside}`)];
    return button(parts, () => this.context.showSource(run, place), {
      class: 'place',
      title: 'Show the program at this line',
    });
  }

  private event(run: Run, event: RunEvent): HTMLElement {
    const { place } = event;
    return element(
      'li',
      { class: this.later(event.time) },
      this.time(event.time),
      place ? this.module(run, place.module) : '',
      element('span', {}, event.text),
      place ? this.place(run, place, '') : '',
    );
  }

  private fault(run: Run, fault: Fault): HTMLElement {
    return element(
      'li',
      { class: `fault ${this.later(fault.time)}`.trim() },
      element(
        'div',
        { class: 'fault-head' },
        this.time(fault.time),
        this.module(run, fault.module),
        element('span', { class: 'quiet' }, fault.role),
      ),
      element('p', { class: 'fault-text' }, fault.text || fault.name),
      this.place(run, fault, fault.function),
      fault.sourceLine && element('pre', { class: 'source' }, fault.sourceLine.trim()),
    );
  }
}
