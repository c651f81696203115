/** The plots under the view: several at once, each with any fields of any run, all over one stretch of time. */

import { labelledLinks } from '../model/difference.ts';
import type { Run } from '../model/run.ts';
import type { PlotTheme } from '../plot/plot.ts';
import { TimeWindow } from '../plot/time_window.ts';
import type { Context, Panel } from './context.ts';
import { button, element } from './dom.ts';
import { FieldPicker } from './field_picker.ts';
import { icon } from './icons.ts';
import { PlotView, type PlotKeeper } from './plot_view.ts';
import { recall, remember } from './settings.ts';

/** Lengths of the window of time, seconds; 0: all that is there. */
const WINDOWS = [5, 10, 30, 60, 120, 0];
/** Trails of more links hide the robot, and take long to draw. */
const MOST_TRAILS = 24;
/** How much a key zooms. */
const KEY_ZOOM = 1.5;

export class PlotsPanel implements Panel, PlotKeeper {
  readonly element: HTMLElement;
  hover = NaN;
  chosen: [number, number] | null = null;
  readonly list = element('div', { class: 'plot-list' });
  private readonly empty = element(
    'p',
    { class: 'empty' },
    'No plots. "Add plot" shows any field of any message against sim time.',
  );
  private readonly picker: FieldPicker;
  private views: PlotView[] = [];
  private readonly window = new TimeWindow(recall('plotWindow', 10));
  private drawnKey = '';
  private theme: PlotTheme = { text: '', grid: '', cursor: '', mark: '' };
  /** Whether the plots with which the page begins were made, or the user's own were. */
  private furnished = false;
  private readonly windowSelect = element(
    'select',
    { 'aria-label': 'Length of the plots', onchange: () => this.setWindow(Number(this.windowSelect.value)) },
    ...WINDOWS.map((w) => element('option', { value: w, selected: w === recall('plotWindow', 10) }, w ? `${w} s` : 'all')),
  );
  private readonly fit = button('Zoom out', () => this.reset(), {
    title: 'All plots over the chosen length again (0, or a double click)',
    'data-action': 'zoom-out',
    hidden: true,
  });

  constructor(private readonly context: Context) {
    this.picker = new FieldPicker(context.session);
    const choose = (): void => this.picker.open([], (ids) => ids.length && this.add(ids));
    const degrees = element('input', {
      type: 'checkbox',
      checked: context.degrees,
      onchange: () => {
        this.context.degrees = degrees.checked;
        remember('degrees', degrees.checked);
      },
    });
    this.element = element(
      'section',
      { class: 'plots', 'aria-label': 'Plots' },
      element(
        'div',
        { class: 'toolbar' },
        element('h2', {}, 'Plots'),
        button([icon('add'), 'Add plot'], choose, { 'data-action': 'add-plot' }),
        element('span', { class: 'spring' }),
        this.fit,
        element('label', {}, degrees, 'degrees'),
        this.windowSelect,
      ),
      this.empty,
      this.list,
    );
    new ResizeObserver(() => this.readTheme()).observe(this.element);
  }

  /** Adds a plot of these fields. */
  add(fields: string[]): void {
    this.furnished = true;
    this.make(fields);
    this.save();
  }

  /** The fields of all plots, and their length in seconds, for layouts. */
  get layout(): { plots: string[][]; window: number } {
    return { plots: this.views.map((view) => view.fields), window: this.window.length };
  }

  /** Shows these plots in place of those that are there. */
  restore(plots: readonly string[][]): void {
    for (const view of [...this.views]) this.drop(view);
    this.furnished = true;
    for (const fields of plots) this.make([...fields]);
    this.save();
  }

  /** So many seconds, 0 for all. */
  setLength(seconds: number): void {
    if (!WINDOWS.includes(seconds)) return;
    this.windowSelect.value = String(seconds);
    this.setWindow(seconds);
  }

  /** Colours may have changed with the theme. */
  readTheme(): void {
    const styles = getComputedStyle(this.element);
    const colour = (name: string): string => styles.getPropertyValue(name).trim();
    this.theme = {
      text: colour('--text-quiet'),
      grid: colour('--line'),
      cursor: colour('--accent'),
      mark: colour('--fault'),
    };
  }

  /** Other runs are shown now: the user's plots of runs of these names come back, else those of the beginning are made. */
  resetRuns(): void {
    for (const view of [...this.views]) this.drop(view);
    this.furnished = false;
    this.window.reset(0);
    const key = this.storageKey();
    const saved = key ? recall<string[][]>(key, []) : [];
    for (const fields of saved) this.make(fields);
    if (saved.length) this.furnished = true;
  }

  update(): void {
    const { session, time } = this.context;
    if (!this.theme.text) this.readTheme();
    if (!this.furnished) this.furnish();
    this.empty.hidden = this.views.length > 0;
    this.fit.hidden = !this.window.zoomed;
    if (Number.isNaN(time)) return;
    const range = session.range();
    const [from, to] = this.window.at(time, range.begin, range.end);
    // Nothing is drawn again that would look the same. A legend that grows leaves its plot less room.
    const key = [
      from,
      to,
      time,
      this.hover,
      this.chosen,
      session.messages,
      this.context.degrees,
      this.context.selected?.module,
      this.list.clientWidth,
      window.devicePixelRatio,
      this.theme.text,
      this.views.map((view) => view.key()),
    ].join();
    if (key === this.drawnKey) return;
    this.drawnKey = key;
    const marks = session.runs.flatMap((run) => run.faults.list.map((fault) => fault.time));
    for (const view of this.views) view.draw(from, to, marks, this.theme);
  }

  edit(view: PlotView): void {
    this.picker.open(view.fields, (ids) => view.setFields(ids));
  }

  changed(view: PlotView): void {
    if (!view.fields.length) this.drop(view);
    this.save();
  }

  zoom(factor: number, about: number): void {
    this.window.zoom(factor, about);
  }

  /** By a key: about the instant that is shown. */
  zoomStep(direction: 1 | -1): void {
    this.zoom(direction > 0 ? 1 / KEY_ZOOM : KEY_ZOOM, this.context.time);
  }

  pan(seconds: number): void {
    this.window.pan(seconds);
  }

  show(from: number, to: number): void {
    this.window.show(from, to);
  }

  /** The length that the user has chosen, with the cursor in it. */
  reset(): void {
    this.window.reset(this.context.time);
  }

  private make(fields: string[]): void {
    const view = new PlotView(this.context, this, fields);
    this.views.push(view);
    this.list.append(view.element);
  }

  private drop(view: PlotView): void {
    this.views = this.views.filter((v) => v !== view);
    view.element.remove();
  }

  private setWindow(seconds: number): void {
    this.window.setSeconds(seconds, this.context.time);
    remember('plotWindow', seconds);
  }

  private storageKey(): string {
    return this.context.session.runs.length ? `plots.${this.context.session.runs.map((r) => r.name).join('+')}` : '';
  }

  private save(): void {
    const key = this.storageKey();
    if (key)
      remember(
        key,
        this.views.map((view) => view.fields),
      );
  }

  /** The plots with which the page begins: joints with a label, and the heights of labelled links or the differences. */
  private furnish(): void {
    const { session } = this.context;
    if (!session.runs.length || session.runs.some((run) => !run.poses.length)) return;
    if (session.difference) return this.furnishPairs();
    const [run] = session.runs;
    const joints = labelledJoints(run);
    if (!joints.length) return;
    this.furnished = true;
    this.make(joints.slice(0, 4).map((joint) => `${run.name}|joints|${joint} position`));
    const links = trailedLinks(run);
    if (links.length) this.make(links.slice(0, 6).map((link) => `${run.name}|poses|${link}.y`));
  }

  /** Of two runs the same joints under one sign, and by how much labelled links lie apart. */
  private furnishPairs(): void {
    const { pairs, difference } = this.context.session;
    if (!difference?.pairNames.length) return;
    this.furnished = true;
    const joints = pairs.filter((pair) => pair.kind === 'joint' && pair.labelled);
    // One of each module: the labels of one module tell less than those of several.
    const firsts = joints.filter((pair, i) => joints.findIndex((p) => p.moduleA === pair.moduleA) === i);
    if (firsts.length) this.make(firsts.slice(0, 2).map((pair) => `|pairs|${pair.name} position`));
    this.make(
      trailed(difference.pairNames, (name) => name)
        .slice(0, 8)
        .map((name) => `|difference|${name} position`),
    );
  }
}

/** Of names with labels those that speak of feet, if there are any: they say most of how a robot walks. */
function trailed<T>(items: readonly T[], name: (item: T) => string): T[] {
  const feet = items.filter((item) => /foot/i.test(name(item).split('.').pop() ?? ''));
  return feet.length ? feet : [...items];
}

/** The links of a run that leave trails: its feet, else all with a label. */
export function trailedLinks(run: Run): string[] {
  const links = trailed([...labelledLinks(run)], ([name]) => name).flatMap(([, links]) => links);
  return links.slice(0, MOST_TRAILS);
}

/** "module.joint" of every label of a joint, the lower parts of legs first. */
function labelledJoints(run: Run): string[] {
  const joints: string[] = [];
  for (const module of run.moduleNames) {
    const label = run.lastState(module)?.labels.find((l) => l.kind === 'joint');
    if (label) joints.push(`${module}.${label.target}`);
  }
  return joints;
}
