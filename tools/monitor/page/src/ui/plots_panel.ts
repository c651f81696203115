/** The plots under the view: several at once, each with any fields of any run. */

import { parseFieldId, seriesOf } from '../model/fields.ts';
import { labelledLinks } from '../model/difference.ts';
import { fieldName, ownerOf } from '../model/names.ts';
import type { Run } from '../model/run.ts';
import type { Series } from '../plot/decimate.ts';
import { Plot, type PlotLine, type PlotTheme } from '../plot/plot.ts';
import { valueText } from '../plot/ticks.ts';
import { LINE_COLOURS, shade } from '../view3d/palette.ts';
import { displayUnit, type Context, type Panel } from './context.ts';
import { button, element, fill, setText } from './dom.ts';
import { FieldPicker } from './field_picker.ts';
import { icon, iconButton } from './icons.ts';
import { recall, remember } from './settings.ts';

/** Lengths of the window of time, seconds; 0: all that is there. */
const WINDOWS = [5, 10, 30, 60, 120, 0];

interface PlotView {
  fields: string[];
  plot: Plot;
  element: HTMLElement;
  legend: HTMLElement;
  legendKey: string;
  values: HTMLElement[];
}

interface ResolvedLine extends PlotLine {
  name: string;
  unit: string;
}

export class PlotsPanel implements Panel {
  readonly element: HTMLElement;
  private readonly list = element('div', { class: 'plot-list' });
  private readonly empty = element(
    'p',
    { class: 'empty' },
    'No plots. "Add plot" shows any field of any message against sim time.',
  );
  private readonly picker: FieldPicker;
  private views: PlotView[] = [];
  private window = recall('plotWindow', 10);
  private begin = 0;
  private hover = NaN;
  private drawnKey = '';
  private theme: PlotTheme = { text: '', grid: '', cursor: '', mark: '' };
  /** Whether the plots with which the page begins were made, or the user's own were. */
  private furnished = false;
  private readonly windowSelect = element(
    'select',
    { 'aria-label': 'Length of the plots', onchange: () => this.setWindow(Number(this.windowSelect.value)) },
    ...WINDOWS.map((w) => element('option', { value: w, selected: w === this.window }, w ? `${w} s` : 'all')),
  );

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
  reset(): void {
    for (const view of [...this.views]) this.drop(view);
    this.furnished = false;
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
    if (Number.isNaN(time)) return;
    let from: number;
    let to: number;
    if (this.window) {
      // The window moves when the instant that is shown leaves it.
      if (time > this.begin + this.window) this.begin = time - this.window;
      if (time < this.begin) this.begin = time;
      [from, to] = [this.begin, this.begin + this.window];
    } else {
      const span = session.range();
      [from, to] = [span.begin, Math.max(span.begin + 1, span.end)];
    }
    // Nothing is drawn again that would look the same. A legend that grows leaves its plot less room.
    const heights = this.views.map((view) => view.plot.canvas.clientHeight);
    const size = `${this.list.clientWidth} ${heights.join(' ')} ${window.devicePixelRatio}`;
    const key = [
      from,
      to,
      time,
      this.hover,
      session.messages,
      this.context.degrees,
      size,
      this.theme.text,
      this.views.map((v) => v.fields),
      this.views.map((v) => this.coloursOf(v.fields)),
    ].join();
    if (key === this.drawnKey) return;
    this.drawnKey = key;
    const marks = session.runs.flatMap((run) => run.faults.list.map((fault) => fault.time));
    for (const view of this.views) this.draw(view, from, to, marks);
  }

  private draw(view: PlotView, from: number, to: number, marks: number[]): void {
    const colours = this.coloursOf(view.fields);
    const lines = view.fields.map((id, i) => this.resolve(id, colours[i]));
    const present = lines.filter((line): line is ResolvedLine => line !== null);
    view.plot.draw(present, from, to, this.context.time, this.hover, marks, this.theme);
    const at = Number.isNaN(this.hover) ? this.context.time : this.hover;
    this.showLegend(view, lines);
    lines.forEach((line, i) =>
      setText(view.values[i], line ? `${valueText(valueAt(line.series, at) * line.scale)} ${line.unit}` : 'not there'),
    );
  }

  /**
   * A line has the colour of its module or role, as in the view; further ones of that colour in the plot are darker or
   * lighter. What is of no module has a colour by its place.
   */
  private coloursOf(fields: readonly string[]): string[] {
    const seen = new Map<string, number>();
    return fields.map((id, i) => {
      const colour = this.ownColour(id) ?? LINE_COLOURS[i % LINE_COLOURS.length];
      // Lines of the second run are dashed, and need no other colour.
      const key = `${parseFieldId(id)?.run} ${colour}`;
      const repeat = seen.get(key) ?? 0;
      seen.set(key, repeat + 1);
      return shade(colour, repeat);
    });
  }

  /** The colour of the module or role that a field is of; null if it is of none. */
  private ownColour(id: string): string | null {
    const parsed = parseFieldId(id);
    if (!parsed) return null;
    if (parsed.table === 'difference') return this.context.colourOfRole(parsed.column.split('.')[0]);
    const run = this.context.session.runs.find((r) => r.name === parsed.run);
    const module = ownerOf(parsed.table, parsed.column)?.module;
    return run && module && run.moduleNames.includes(module) ? this.context.lineColourOf(run, module) : null;
  }

  private resolve(id: string, colour: string): ResolvedLine | null {
    const parsed = parseFieldId(id);
    if (!parsed) return null;
    const { session } = this.context;
    const run = session.runs.find((r) => r.name === parsed.run);
    const isDifference = parsed.table === 'difference';
    const found = seriesOf(isDifference ? session.difference : run?.tables.get(parsed.table), parsed.column);
    if (!found) return null;
    // What two like robots differ by is small.
    const shown = displayUnit(found.unit, this.context.degrees);
    const { unit, scale } = isDifference && shown.unit === 'm' ? { unit: 'mm', scale: 1000 } : shown;
    return {
      series: found.series,
      colour,
      scale,
      unit,
      dashed: run !== undefined && session.runs.indexOf(run) > 0,
      name: run ? this.nameOf(run, parsed.table, parsed.column) : parsed.column,
    };
  }

  /** Short enough for a legend: the table's name only where the column does not speak for itself. */
  private nameOf(run: Run, table: string, column: string): string {
    const plain = table === 'poses' || table === 'joints' || table === 'channels';
    const letter = this.context.session.runs.length > 1 ? `${run.letter} ` : '';
    return `${letter}${plain ? '' : `${table} `}${fieldName(run, table, column)}`;
  }

  private showLegend(view: PlotView, lines: readonly (ResolvedLine | null)[]): void {
    const colours = this.coloursOf(view.fields);
    const key = lines.map((line, i) => `${colours[i]} ${line?.name ?? view.fields[i]}`).join('\n');
    if (key === view.legendKey) return;
    view.legendKey = key;
    view.values = lines.map(() => element('span', { class: 'value' }));
    fill(
      view.legend,
      ...lines.map((line, i) => {
        const colour = element('span', { class: 'stroke', 'aria-hidden': 'true' });
        colour.style.background = colours[i];
        return element(
          'span',
          { class: 'entry' },
          colour,
          element('span', { class: 'name' }, line?.name ?? view.fields[i].replace(/\|/g, ' ')),
          view.values[i],
          iconButton('close', 'Remove from the plot', () => this.removeField(view, i), {
            class: 'small',
            'aria-label': `Remove ${line?.name ?? view.fields[i]} from the plot`,
          }),
        );
      }),
    );
    view.plot.canvas.setAttribute('aria-label', `Plot of ${lines.map((l, i) => l?.name ?? view.fields[i]).join(', ')}`);
  }

  private make(fields: string[]): void {
    const canvas = element('canvas', { class: 'plot-canvas', role: 'img' });
    const legend = element('div', { class: 'legend' });
    const view: PlotView = {
      fields,
      plot: new Plot(canvas),
      element: element('div', { class: 'plot' }),
      legend,
      legendKey: '',
      values: [],
    };
    const edit = (): void => this.picker.open(view.fields, (ids) => this.setFields(view, ids));
    view.element.append(
      element(
        'div',
        { class: 'plot-head' },
        legend,
        element('span', { class: 'spring' }),
        iconButton('add', 'Choose the fields of this plot', edit, { class: 'small' }),
        iconButton('close', 'Close this plot', () => this.setFields(view, []), { class: 'small' }),
      ),
      canvas,
    );
    canvas.addEventListener('pointermove', (event) => (this.hover = view.plot.timeAt(event.offsetX) ?? NaN));
    canvas.addEventListener('pointerleave', () => (this.hover = NaN));
    canvas.addEventListener('click', (event) => {
      const time = view.plot.timeAt(event.offsetX);
      if (time !== null) this.context.seek(time);
    });
    this.views.push(view);
    this.list.append(view.element);
  }

  private drop(view: PlotView): void {
    this.views = this.views.filter((v) => v !== view);
    view.element.remove();
  }

  private setFields(view: PlotView, fields: string[]): void {
    if (!fields.length) this.drop(view);
    view.fields = fields;
    this.save();
  }

  private removeField(view: PlotView, index: number): void {
    this.setFields(
      view,
      view.fields.filter((_, i) => i !== index),
    );
  }

  private setWindow(seconds: number): void {
    this.window = seconds;
    this.begin = this.context.time - seconds;
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
    if (!session.runs.length || session.runs.some((run) => !run.poses.length || !labelledJoints(run).length)) return;
    if (session.difference && !session.difference.pairNames.length) return;
    this.furnished = true;
    const perRun = session.runs.length > 1 ? 2 : 4;
    this.make(
      session.runs.flatMap((run) =>
        labelledJoints(run)
          .slice(0, perRun)
          .map((joint) => `${run.name}|joints|${joint} position`),
      ),
    );
    if (session.difference) {
      this.make(
        trailed(session.difference.pairNames, (name) => name)
          .slice(0, 8)
          .map((name) => `|difference|${name} position`),
      );
    } else {
      const links = trailedLinks(session.runs[0]);
      if (links.length) this.make(links.slice(0, 6).map((link) => `${session.runs[0].name}|poses|${link}.y`));
    }
  }
}

/** Of names with labels those that speak of feet, if there are any: they say most of how a robot walks. */
function trailed<T>(items: readonly T[], name: (item: T) => string): T[] {
  const feet = items.filter((item) => /foot/i.test(name(item).split('.').pop() ?? ''));
  return feet.length ? feet : [...items];
}

/** The links of a run that leave trails: its feet, else all with a label. */
export function trailedLinks(run: Run): string[] {
  return trailed([...labelledLinks(run)], ([name]) => name).flatMap(([, links]) => links);
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

/** The value of the last row at or before `time`; NaN without one. */
function valueAt(series: Series, time: number): number {
  const row = series.lowerBound(time + 1e-9) - 1;
  return row >= 0 && row < series.length ? series.value(row) : NaN;
}
