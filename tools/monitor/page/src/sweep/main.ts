/** The part of a sweep's report that answers to its reader: plots of all rows, and a table to sort. */

import { HeatmapChart, LineChart, ParallelChart, ScatterChart } from 'echarts/charts';
import { GridComponent, ParallelComponent, TooltipComponent, VisualMapComponent } from 'echarts/components';
import { init, use, type EChartsType } from 'echarts/core';
import { CanvasRenderer } from 'echarts/renderers';
import { element, fill } from '../ui/dom.ts';
import { escapeText, heatOption, parallelOption, scatterOption, searchOption, themeOf, type Option } from './charts.ts';
import { candidatesOf, effectOf, frontOf, improvementsOf, isNumeric, ordered, placesOf, seriesOf, valueText, type Series, type Sweep } from './data.ts';

use([HeatmapChart, LineChart, ParallelChart, ScatterChart, GridComponent, ParallelComponent, TooltipComponent, VisualMapComponent, CanvasRenderer]);

/** Rows of the table that are made at once, for a browser takes long over thousands. */
const TABLE_ROWS = 100;
/** Axes of the parallel coordinates that stand there at first. */
const PARALLEL_AXES = 8;

class Report {
  private readonly series: Series[];
  private readonly goal: Series;
  private readonly done: number[];
  /** The rows that the reader chose in the parallel coordinates. */
  private chosen: number[];
  private readonly charts: { chart: EChartsType; draw: () => void }[] = [];
  private readonly tableBox = element('div', { class: 'scroll' });
  private readonly note = element('p', { class: 'dim' });
  private sortBy: Series | null;
  private descending: boolean;
  private shown = TABLE_ROWS;
  private pointed = -1;

  constructor(
    private readonly sweep: Sweep,
    private readonly place: HTMLElement,
  ) {
    this.series = seriesOf(sweep);
    this.goal = this.series.find((one) => one.name === sweep.goal) as Series;
    this.done = sweep.rows.flatMap((row, i) => (row.status === 'done' ? [i] : []));
    this.chosen = sweep.rows.map((_, i) => i);
    this.sortBy = this.goal;
    this.descending = !sweep.smallest;
  }

  build(): void {
    const inputs = this.inputsByEffect();
    const numbers = this.series.filter(isNumeric);
    fill(this.place, element('h2', {}, 'All rows'));
    const charts = element('div', { class: 'charts' });
    this.place.append(charts);
    const first = inputs[0] ?? numbers[0];
    if (first && this.done.length > 0) {
      if (this.sweep.search.length > 0) this.addSearch(charts);
      this.addScatter(charts, first, inputs);
      if (inputs.length >= 2) this.addHeat(charts, inputs, numbers);
      if (this.series.length >= 3) this.addParallel();
    }
    this.place.append(this.note, this.tableBox);
    this.drawTable();
    const draw = (): void => this.charts.forEach((one) => one.draw());
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', draw);
    addEventListener('resize', () => {
      for (const { chart, draw } of this.charts) {
        const before = chart.getWidth();
        chart.resize();
        // What a reader chose in a plot stays where its width does.
        if (chart.getWidth() !== before) draw();
      }
    });
    draw();
  }

  /** The inputs, of which the first ones make most of a difference. */
  private inputsByEffect(): Series[] {
    const effects = this.series
      .filter((one) => one.input)
      .map((series) => ({ series, effect: effectOf(series, this.goal, this.done) }));
    return effects.sort((a, b) => b.effect - a.effect).map((one) => one.series);
  }

  /** A plot with boxes above it, each of which chooses a series; `option` is what it then shows. */
  private addChart(
    parent: Element,
    title: string,
    choices: readonly { label: string; from: readonly Series[]; first: Series }[],
    option: (chosen: Series[], width: number) => Option,
  ): EChartsType {
    const boxes = choices.map(({ label, from, first }) => {
      const box = element('select', { 'aria-label': label, onchange: () => draw() });
      from.forEach((one, i) => box.append(element('option', { value: i, selected: one === first }, one.name)));
      return { label, box, from };
    });
    const canvas = element('div', { class: 'chart', role: 'img', 'aria-label': title });
    const controls = boxes.map(({ label, box }) => element('label', {}, `${label} `, box));
    const panel = element('div', { class: 'panel' }, element('h3', {}, title), element('div', { class: 'controls' }, ...controls), canvas);
    parent.append(panel);
    const chart = init(canvas);
    const draw = (): void => {
      const chosen = boxes.map(({ box, from }) => from[Number(box.value)]);
      chart.setOption(option(chosen, chart.getWidth()), { notMerge: true });
    };
    this.charts.push({ chart, draw });
    return chart;
  }

  private addScatter(parent: Element, first: Series, inputs: readonly Series[]): void {
    const colour = inputs.find((one) => one !== first) ?? this.goal;
    const choices = [
      { label: 'across', from: [...this.series, placesOf(this.sweep)], first },
      { label: 'up', from: this.series, first: this.goal },
      { label: 'colour', from: this.series, first: colour },
    ];
    const chart = this.addChart(parent, 'A point a row', choices, ([x, y, shade]) =>
      scatterOption([x, y, shade], this.done, themeOf(this.place), (row) => this.describe(row)),
    );
    chart.on('click', (event) => this.point((event.value as number[])[3]));
  }

  /** How a search went: what it tried and the best so far, and of several goals the front. */
  private addSearch(parent: Element): void {
    const goals = this.sweep.search.map((goal, i) => ({
      name: goal.text,
      input: false,
      values: this.sweep.rows.map((row) => row.goals[i]),
    }));
    const allowed = candidatesOf(this.sweep);
    const chosen = new Set(allowed);
    const others = this.done.filter((row) => !chosen.has(row));
    const add = (title: string, axes: readonly [Series, Series], line: readonly number[], step: boolean): void => {
      const chart = this.addChart(parent, title, [], () =>
        searchOption(axes, { allowed, others, line, step }, themeOf(this.place), (row) => this.describe(row)),
      );
      chart.on('click', (event) => this.point((event.value as number[])[2]));
    };
    goals.forEach((goal, i) => {
      const best = this.sweep.search[i].smallest ? 'The least so far' : 'The most so far';
      add(`${best}: ${goal.name}`, [placesOf(this.sweep), goal], improvementsOf(this.sweep, i), true);
    });
    for (let i = 1; i < goals.length; i++)
      add('Nothing is better than the line in both', [goals[0], goals[i]], frontOf(this.sweep, [0, i]), false);
  }

  private addHeat(parent: Element, inputs: readonly Series[], numbers: readonly Series[]): void {
    const choices = [
      { label: 'across', from: inputs, first: inputs[0] },
      { label: 'up', from: inputs, first: inputs[1] },
      { label: 'mean of', from: numbers, first: this.goal },
    ];
    this.addChart(parent, 'By two inputs', choices, ([x, y, value]) =>
      heatOption([x, y, value], this.done, themeOf(this.place)),
    );
  }

  /** All inputs and the goal; a reader who chooses ranges of the axes sees the rows in them below. */
  private addParallel(): void {
    const inputs = this.series.filter((one) => one.input);
    const axes = [...inputs.slice(0, PARALLEL_AXES - 1), this.goal];
    const others = this.series.filter((one) => !axes.includes(one) && isNumeric(one));
    const more = others.length > 0 ? [{ label: 'last axis', from: [this.goal, ...others], first: this.goal }] : [];
    const chart = this.addChart(this.place, 'A line a row: draw along an axis to choose rows', more, ([last], width) => {
      // A plot that is drawn anew has no ranges.
      this.choose(this.sweep.rows.map((_, i) => i));
      return parallelOption([...axes.slice(0, -1), last ?? this.goal], last ?? this.goal, this.done, themeOf(this.place), width);
    });
    chart.on('axisareaselected', () => {
      // The only way to the lines that are chosen, by ECharts' own example.
      const model = (chart as unknown as { getModel(): any }).getModel();
      const active: number[] = model.getSeries()[0].getRawIndicesByActiveState('active');
      const normal: number[] = model.getSeries()[0].getRawIndicesByActiveState('normal');
      this.choose(normal.length > 0 ? this.sweep.rows.map((_, i) => i) : active.map((i) => this.done[i]));
    });
  }

  /** The rows that the table shows. */
  private choose(rows: number[]): void {
    this.chosen = rows;
    this.shown = TABLE_ROWS;
    this.drawTable();
  }

  /** What a row was told and came to, as HTML of a tooltip. */
  private describe(row: number): string {
    const inputs = this.series.filter((one) => one.input).map((one) => `${one.name} = ${valueText(one.values[row])}`);
    const goal = `${this.goal.name}: ${valueText(this.goal.values[row])}`;
    return [`row ${this.sweep.rows[row].row}`, ...inputs, goal].map(escapeText).join('<br>');
  }

  /** Shows a row in the table, with the command that runs it again. */
  private point(row: number): void {
    this.pointed = row;
    this.drawTable();
    this.tableBox.querySelector('tr.chosen')?.scrollIntoView({ block: 'center' });
  }

  private drawTable(): void {
    const rows = this.sortBy === null ? this.chosen : ordered(this.sortBy, this.chosen, this.descending);
    const listed = rows.slice(0, this.shown);
    if (this.pointed >= 0 && !listed.includes(this.pointed)) listed.unshift(this.pointed);
    const head = element('tr', {}, this.headOf('row', null), ...this.series.map((one) => this.headOf(one.name, one)), element('th', {}, 'status'));
    const body = listed.map((row) => this.rowOf(row));
    fill(this.tableBox, element('table', {}, element('thead', {}, head), element('tbody', {}, ...body)));
    if (listed.length < rows.length) {
      const more = (): void => {
        this.shown *= 10;
        this.drawTable();
      };
      this.tableBox.append(element('button', { type: 'button', onclick: more }, `${rows.length - listed.length} more`));
    }
    const all = this.sweep.rows.length;
    const count = this.chosen.length < all ? `${this.chosen.length} of ${all} rows are chosen. ` : '';
    const command = this.pointed < 0 ? 'A row that is clicked is named with its command.' : 'The row again, with its log: ';
    fill(this.note, count + command, this.pointed >= 0 && element('code', {}, this.commandOf(this.pointed)));
  }

  private commandOf(row: number): string {
    const { row: number } = this.sweep.rows[row];
    return `${this.sweep.rerun}${number} --log row-${number}.log`;
  }

  /** A heading by which the table is sorted; null stands for the rows' own order. */
  private headOf(name: string, series: Series | null): HTMLElement {
    const sorted = this.sortBy === series;
    const sort = (): void => {
      // The best of a figure comes first; of an input the least.
      this.descending = sorted ? !this.descending : series !== null && !series.input;
      this.sortBy = series;
      this.drawTable();
    };
    const mark = sorted && series !== null ? (this.descending ? ' ▾' : ' ▴') : '';
    const order = mark === '' ? 'none' : this.descending ? 'descending' : 'ascending';
    const number = series === null || isNumeric(series);
    return element('th', { class: number ? 'n' : null, 'aria-sort': order }, element('button', { type: 'button', onclick: sort }, name + mark));
  }

  private rowOf(row: number): HTMLElement {
    const { row: number, status, error } = this.sweep.rows[row];
    const cells = this.series.map((one) => element('td', { class: isNumeric(one) ? 'n' : null }, valueText(one.values[row])));
    const state = element('td', { class: status === 'done' ? null : 'fails', title: error || null }, error ? `${status}: ${error}` : status);
    const onclick = (): void => {
      this.pointed = this.pointed === row ? -1 : row;
      this.drawTable();
    };
    return element('tr', { class: row === this.pointed ? 'chosen' : null, onclick }, element('td', { class: 'n' }, number), ...cells, state);
  }
}

const place = document.getElementById('plots');
const data = document.getElementById('rows');
if (place && data) new Report(JSON.parse(data.textContent ?? '') as Sweep, place).build();
