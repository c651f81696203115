/** One plot with its legend: what it shows, what the pointer does in it, and what can be saved of it. */

import { linesOf, parseFieldId, type FieldLine } from '../model/fields.ts';
import { csvOf } from '../plot/csv.ts';
import { Plot, valueAt, type PlotLine, type PlotTheme } from '../plot/plot.ts';
import { fixedText } from '../plot/ticks.ts';
import { LINE_COLOURS, shade } from '../view3d/palette.ts';
import { displayUnit, type Context } from './context.ts';
import { element, fill, saveFile, setText } from './dom.ts';
import { iconButton } from './icons.ts';
import { followPointer } from './plot_pointer.ts';

/** What plots tell the panel that holds them. */
export interface PlotKeeper {
  /** The user wants to choose the fields anew. */
  edit(view: PlotView): void;
  /** The fields have changed; without any the plot goes. */
  changed(view: PlotView): void;
  /** The time under the pointer; NaN without. */
  hover: number;
  /** The stretch of time that is being chosen by a drag; null without. */
  chosen: [number, number] | null;
  zoom(factor: number, about: number): void;
  pan(seconds: number): void;
  show(from: number, to: number): void;
  reset(): void;
}

interface ShownLine extends PlotLine, FieldLine {
  /** Its place in the plot's fields. */
  field: number;
}

export class PlotView {
  readonly element = element('div', { class: 'plot' });
  readonly canvas = element('canvas', { class: 'plot-canvas', role: 'img' });
  readonly plot = new Plot(this.canvas);
  private readonly legend = element('div', { class: 'legend' });
  private legendKey = '';
  private values: HTMLElement[] = [];
  private lines: ShownLine[] = [];
  private range: [number, number] = [0, 1];

  constructor(
    private readonly context: Context,
    private readonly keeper: PlotKeeper,
    public fields: string[],
  ) {
    const tool = (name: 'add' | 'table' | 'picture' | 'close', title: string, action: () => void): HTMLElement =>
      iconButton(name, title, action, { class: 'small', 'data-action': `plot-${name}` });
    this.element.append(
      element(
        'div',
        { class: 'plot-head' },
        this.legend,
        element('span', { class: 'spring' }),
        tool('add', 'Choose the fields of this plot', () => this.keeper.edit(this)),
        tool('table', 'Save the values that are shown (CSV)', () => this.saveValues()),
        tool('picture', 'Save a picture of this plot (PNG)', () => this.savePicture()),
        tool('close', 'Close this plot', () => this.setFields([])),
      ),
      this.canvas,
    );
    followPointer(this.canvas, this.plot, this.keeper, (x, y, time) => this.click(x, y, time));
  }

  setFields(fields: string[]): void {
    this.fields = fields;
    this.keeper.changed(this);
  }

  /** Draws the stretch of time, with marks at some times. */
  draw(from: number, to: number, marks: number[], theme: PlotTheme): void {
    this.range = [from, to];
    this.lines = this.resolve();
    const { time, selected } = this.context;
    const { hover, chosen } = this.keeper;
    const units = [...new Set(this.lines.map((line) => line.unit).filter(Boolean))];
    const isSelected = (line: ShownLine): boolean =>
      selected !== null && line.run === selected.run && line.module === selected.module;
    this.plot.draw(
      {
        lines: this.lines,
        from,
        to,
        cursor: time,
        hover,
        marks,
        chosen,
        unit: units.join(', '),
        // Where all are of the selected module, none stands out.
        selected: this.lines.every(isSelected) ? -1 : this.lines.findIndex(isSelected),
      },
      theme,
    );
    const at = Number.isNaN(hover) ? time : hover;
    this.showLegend();
    this.lines.forEach((line, i) => {
      const value = fixedText(valueAt(line.series, at) * line.scale, this.plot.step);
      setText(this.values[i], `${value} ${line.unit}`);
    });
  }

  /** By what it looks: its fields and their colours. */
  key(): string {
    return [this.fields, this.colours(), this.canvas.clientHeight].join();
  }

  /** A click shows that instant; one on a line selects its module, too. */
  private click(x: number, y: number, time: number): void {
    this.context.seek(time);
    const line = this.lines[this.plot.lineAt(x, y, this.lines)];
    if (line?.run && line.module) this.context.select({ run: line.run, module: line.module });
  }

  private resolve(): ShownLine[] {
    const { session, degrees } = this.context;
    const colours = this.colours();
    return this.fields.flatMap((id, field) =>
      linesOf(session, id).map((line) => {
        // What two like robots differ by is small.
        const small = line.run === null && line.unit === 'm';
        const { unit, scale } = small ? { unit: 'mm', scale: 1000 } : displayUnit(line.unit, degrees);
        const dashed = line.run !== null && session.runs.indexOf(line.run) > 0;
        const under = line.run !== null && !dashed && parseFieldId(id)?.table === 'pairs';
        return { ...line, colour: colours[field], unit, scale, dashed, under, field };
      }),
    );
  }

  /**
   * A line has the colour of its module or role, as in the view; further ones of that colour in the plot are darker or
   * lighter. What is of no module has a colour by its place. Both lines of a pair have one colour.
   */
  private colours(): string[] {
    const seen = new Map<string, number>();
    return this.fields.map((id, i) => {
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
    const { session } = this.context;
    const parsed = parseFieldId(id);
    const [line] = linesOf(session, id);
    if (line?.run && line.module && line.run.moduleNames.includes(line.module))
      return this.context.lineColourOf(line.run, line.module);
    return parsed && !parsed.run ? this.context.colourOfRole(parsed.column.split('.')[0]) : null;
  }

  private showLegend(): void {
    const missing = this.fields.filter((_, i) => !this.lines.some((line) => line.field === i));
    const key = [...this.lines.map((line) => `${line.colour} ${line.name}`), ...missing].join('\n');
    if (key === this.legendKey) return;
    this.legendKey = key;
    this.values = this.lines.map(() => element('span', { class: 'value' }));
    fill(
      this.legend,
      ...this.lines.map((line, i) => this.entry(line, this.values[i])),
      ...missing.map((id) =>
        element(
          'span',
          { class: 'entry missing' },
          `${id.replace(/\|/g, ' ').trim()}: not there`,
          this.remover(this.fields.indexOf(id), id),
        ),
      ),
    );
    this.canvas.setAttribute('aria-label', `Plot of ${this.lines.map((line) => line.name).join(', ') || 'nothing yet'}`);
  }

  private entry(line: ShownLine, value: HTMLElement): HTMLElement {
    const stroke = element('span', { class: `stroke${line.dashed ? ' dashed' : ''}`, 'aria-hidden': 'true' });
    stroke.style.color = line.colour;
    const { run, module } = line;
    const select = (): void => {
      if (run && module) this.context.select({ run, module });
    };
    return element(
      'span',
      { class: 'entry' },
      stroke,
      element('span', { class: 'name', onclick: select, title: module ? 'Select the module' : '' }, line.name),
      value,
      element('span', { class: 'tools' }, this.rater(line.field), this.remover(line.field, line.name)),
    );
  }

  private remover(field: number, name: string): HTMLElement {
    const remove = (): void => this.setFields(this.fields.filter((_, i) => i !== field));
    return iconButton('close', 'Remove from the plot', remove, {
      class: 'small',
      'aria-label': `Remove ${name} from the plot`,
    });
  }

  /** Goes over from a quantity to how fast it changes, and back. */
  private rater(field: number): HTMLElement {
    const id = this.fields[field];
    const other = id.endsWith('|rate') ? id.slice(0, -'|rate'.length) : `${id}|rate`;
    const change = (): void => this.setFields(this.fields.map((known, i) => (i === field ? other : known)));
    return element(
      'button',
      { type: 'button', class: 'small', title: 'How fast it changes, or the quantity itself', onclick: change },
      'd/dt',
    );
  }

  private fileName(ending: string): string {
    return `${(this.lines[0]?.name ?? 'plot').replace(/[^\w.-]+/g, '_')}.${ending}`;
  }

  private saveValues(): void {
    const text = csvOf(this.lines, ...this.range);
    saveFile(this.fileName('csv'), new Blob([text], { type: 'text/csv' }));
  }

  private savePicture(): void {
    this.canvas.toBlob((blob) => blob && saveFile(this.fileName('png'), blob));
  }
}
