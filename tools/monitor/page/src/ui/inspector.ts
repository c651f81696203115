/** All that is known of the selected module: role and why, labels, signs, tasks, neighbours, fields, messages. */

import { labelsOf, modelName } from '../model/names.ts';
import type { Run } from '../model/run.ts';
import { endedText, type ModuleState } from '../model/run_data.ts';
import { fixedText, timeText } from '../plot/ticks.ts';
import { displayUnit, runTitle, type Context, type Panel, type Selection } from './context.ts';
import { button, element, fill, heading, numberCell, row, setText, swatch, table } from './dom.ts';
import { iconButton } from './icons.ts';
import { signText } from './roles_panel.ts';
import { tree } from './tree.ts';

/** What of a joint and of a link is shown as numbers, with the distance of ticks that gives them decimals. */
const JOINT_QUANTITIES = ['position', 'target', 'velocity', 'effort'];
const LINK_QUANTITIES = ['x', 'y', 'z'];
const NUMBER_STEP = 10;
const PLACE_STEP = 1;

export class Inspector implements Panel {
  readonly element = element('section', { class: 'inspector', 'aria-label': 'Selected module', hidden: true });
  private readonly facts = element('div');
  private readonly numbers = element('div');
  private readonly messages = element('div', { class: 'tree' });
  private readonly title = element('div', { class: 'inspector-head' });
  private shown = '';
  private numbersKey = '';
  private values: { cell: HTMLElement; read: () => string }[] = [];

  /** @param plot shows these fields in a plot of their own. */
  constructor(
    private readonly context: Context,
    private readonly plot: (fields: string[]) => void,
  ) {
    const read = button('Read again', () => this.showMessages(), { title: 'The newest messages', class: 'small' });
    this.element.append(
      this.title,
      element(
        'div',
        { class: 'inspector-body' },
        this.facts,
        this.numbers,
        element('h3', {}, 'Newest messages ', read),
        this.messages,
      ),
    );
  }

  update(): void {
    const { selected, time, session } = this.context;
    this.element.hidden = selected === null;
    if (!selected) {
      this.shown = '';
      return;
    }
    const { run, module } = selected;
    const state = run.stateAt(module, time);
    const neighbours = run.neighboursAt(module, time);
    const key = JSON.stringify([run.name, module, state, neighbours, session.roleQuestions.version]);
    if (key !== this.shown) {
      this.shown = key;
      this.showFacts(selected, state, neighbours);
    }
    this.showNumbers(selected, state);
    for (const { cell, read } of this.values) setText(cell, read());
  }

  private showFacts({ run, module }: Selection, state: ModuleState | null, neighbours: [string, string, string][]): void {
    const { context } = this;
    const info = run.description.modules.find((m) => m.name === module);
    fill(
      this.title,
      swatch(context.colourOf(run, module)),
      element('b', {}, context.session.runs.length > 1 ? `${runTitle(context, run)} · ${module}` : module),
      info ? element('span', { class: 'quiet' }, info.type) : '',
      state?.lost ? element('span', { class: 'tag lost' }, 'lost') : '',
      element('span', { class: 'spring' }),
      iconButton('close', 'Drop the selection (Esc)', () => context.select(null), { class: 'small' }),
    );
    fill(
      this.facts,
      ...this.role(run, module, state),
      ...this.tasks(run, module, state),
      element('h3', {}, 'Neighbours'),
      neighbours.length
        ? element('div', { class: 'chips' }, ...neighbours.map(([own, other, there]) => this.neighbour(run, own, other, there)))
        : element('p', { class: 'empty' }, 'None is known.'),
    );
    this.showMessages();
  }

  private role(run: Run, module: string, state: ModuleState | null): HTMLElement[] {
    if (!state) return [element('p', { class: 'empty' }, 'It has not said anything yet.')];
    const remarks = [
      state.frozen && 'frozen: its role changed too often',
      !state.hasPose && 'no pose',
      state.hasPose && state.poseStale && 'its pose is stale',
      state.incarnation > 1 && `start ${state.incarnation}`,
      endedText(state),
    ].filter(Boolean);
    const since = run.roleSince(module, this.context.time);
    return [
      element(
        'p',
        {},
        element('b', {}, state.role || 'no role'),
        element('span', { class: 'quiet' }, ` since ${timeText(since)}, program ${state.program || 'unknown'}`),
      ),
      ...remarks.map((remark) => element('p', { class: 'remark' }, String(remark))),
      ...this.why(run, module, state),
    ];
  }

  /** What the role asks for and what the module has of it; without a role what each lacks. */
  private why(run: Run, module: string, state: ModuleState): HTMLElement[] {
    const { time, session } = this.context;
    const lines = state.role
      ? session.roleQuestions.why(run, module, state.role, time)
      : session.roleQuestions.missing(run, module, time);
    return (lines ?? []).map((line) =>
      element(
        'div',
        { class: `why ${line.holds ? 'holds' : 'fails'}` },
        `${line.text} `,
        line.line > 0 && this.source(run, module, line.line, line.file),
      ),
    );
  }

  /** @param imported a file that the program imports; empty for its own. */
  private source(run: Run, module: string, line: number, imported: string): HTMLElement {
    const file = imported || run.description.program;
    return button(`${file.split('/').pop() || 'program'}:${line}`, () => this.context.showSource(run, { module, file, line }), {
      class: 'place',
      title: 'Show the program at this line',
    });
  }

  private tasks(run: Run, module: string, state: ModuleState | null): HTMLElement[] {
    if (!state?.tasks.length || state.lost) return [];
    return [
      element('h3', {}, 'Runs now'),
      ...state.tasks.map((task) =>
        element(
          'div',
          {},
          `${task.kind} ${task.function} `,
          task.line > 0 && this.source(run, module, task.line, task.file),
        ),
      ),
    ];
  }

  private neighbour(run: Run, own: string, other: string, there: string): HTMLElement {
    return button([`${own} – `, element('b', {}, other), `.${there}`], () => this.context.select({ run, module: other }), {
      class: 'chip',
      title: `Select ${other}`,
    });
  }

  /** Joints and links with their values at the instant that is shown. */
  private showNumbers({ run, module }: Selection, state: ModuleState | null): void {
    const info = run.description.modules.find((m) => m.name === module);
    const links = run.links.filter((link) => link.startsWith(`${module}/`)).map((link) => link.slice(module.length + 1));
    const joints = info?.joints.map((joint) => joint.name) ?? [];
    const key = JSON.stringify([run.name, module, state?.role, state?.labels, state?.signs, links, joints, this.context.degrees]);
    if (key === this.numbersKey) return;
    this.numbersKey = key;
    this.values = [];
    fill(
      this.numbers,
      ...this.parts(run, module, state, 'joint', joints, JOINT_QUANTITIES),
      ...this.parts(run, module, state, 'link', links, LINK_QUANTITIES),
    );
  }

  private parts(
    run: Run,
    module: string,
    state: ModuleState | null,
    kind: 'joint' | 'link',
    parts: readonly string[],
    quantities: readonly string[],
  ): HTMLElement[] {
    if (!parts.length) return [];
    const [tableName, separator] = kind === 'joint' ? ['joints', ' '] : ['poses', '.'];
    const rows = parts.map((part) => {
      const name = modelName({ module, kind, part, quantity: '' });
      const labels = labelsOf(state, kind, part);
      const sign = kind === 'joint' ? (state?.signs.find((s) => s.joint === part)?.sign ?? 0) : 0;
      const cells = quantities.map((quantity) => {
        const cell = numberCell('');
        this.values.push({ cell, read: () => this.value(run, tableName, `${name}${separator}${quantity}`) });
        return cell;
      });
      const fields = quantities.map((quantity) => `${run.name}|${tableName}|${name}${separator}${quantity}`);
      const plotted = kind === 'joint' ? fields.slice(0, 2) : fields;
      return row(
        element(
          'td',
          {},
          element('b', {}, labels.join(', ') || part),
          labels.length ? element('span', { class: 'quiet' }, ` ${part}`) : '',
          kind === 'joint' && element('b', { class: 'sign' }, ` ${signText(sign)}`),
        ),
        ...cells,
        element('td', {}, iconButton('add', `Plot ${labels[0] ?? part}`, () => this.plot(plotted), { class: 'small' })),
      );
    });
    const head = row(
      heading(kind === 'joint' ? 'Joint' : 'Link'),
      ...quantities.map((quantity) => heading(quantity, { class: 'number' })),
      heading(''),
    );
    return [table('numbers', [head], rows)];
  }

  private value(run: Run, tableName: string, column: string): string {
    const named = run.tables.get(tableName);
    const index = named?.table.find(column) ?? -1;
    const line = named?.table.rowAt(this.context.time + 1e-9) ?? -1;
    if (!named || index < 0 || line < 0) return '–';
    const { unit, scale } = displayUnit(named.unit(column), this.context.degrees);
    const text = fixedText(named.table.value(index, line) * scale, tableName === 'poses' ? PLACE_STEP : NUMBER_STEP);
    return text === '–' ? text : `${text} ${unit}`;
  }

  /** What the newest message of each topic says of the module. */
  private showMessages(): void {
    const { selected } = this.context;
    if (!selected) return;
    const { run, module } = selected;
    fill(
      this.messages,
      ...[...run.newest].flatMap(([topic, { time, message }]) => {
        const part = partOf(message, module);
        return part === null ? [] : [tree(`${topic} · ${timeText(time)}`, part)];
      }),
    );
  }
}

/** What of a message is of a module: all of it, or the elements of its lists that name it; null without any. */
function partOf(message: Record<string, unknown>, module: string): unknown {
  if (message.module === module || message.process === module) return message;
  const names = (item: any): boolean => [item?.module, item?.moduleA, item?.moduleB, item?.name].includes(module);
  const lists = Object.entries(message).flatMap(([name, value]): [string, unknown][] => {
    const own = Array.isArray(value) ? value.filter(names) : [];
    return own.length ? [[name, own.length === 1 ? own[0] : own]] : [];
  });
  if (!lists.length) return null;
  return lists.length === 1 ? lists[0][1] : Object.fromEntries(lists);
}
