/** The list of modules with role, labels, convention signs and tasks, as of the instant that is shown. */

import type { RoleFinding } from '../model/role_questions.ts';
import type { Run } from '../model/run.ts';
import { endedText, type ModuleState } from '../model/run_data.ts';
import { runHeading, type Context, type Panel } from './context.ts';
import { breakable, button, element, fill, heading, row, swatch, table } from './dom.ts';

/** A convention sign as people write it. */
export function signText(sign: number): string {
  return sign > 0 ? '+' : sign < 0 ? '−' : '·';
}

function signTitle(sign: number): string {
  if (sign === 0) return 'no convention is set for this joint';
  return sign > 0
    ? "the program's positive direction is the actuator's"
    : "the program's positive direction is opposite to the actuator's";
}

export class RolesPanel implements Panel {
  readonly element = element('div', { class: 'panel-body' });
  private shown: string | null = null;

  constructor(private readonly context: Context) {}

  update(): void {
    const { session, time, selected } = this.context;
    // Everything that the list depends on; without a change nothing is made anew.
    const states = session.runs.map((run) =>
      run.moduleNames.map((module) => [module, run.stateAt(module, time)] as const),
    );
    const key = JSON.stringify([states, selected?.module, selected?.run.name, session.roleQuestions.version]);
    if (key === this.shown) return;
    this.shown = key;
    const empty = element('p', { class: 'empty' }, 'The modules of a run, with their roles, labels and signs.');
    fill(this.element, ...(session.runs.length ? session.runs.flatMap((run, i) => this.section(run, states[i])) : [empty]));
  }

  private section(run: Run, states: readonly (readonly [string, ModuleState | null])[]): HTMLElement[] {
    const title = runHeading(this.context, run);
    if (!states.length) {
      return [
        ...title,
        element(
          'p',
          { class: 'empty' },
          'No module has said anything yet. Roles appear here as soon as the modules have found them.',
        ),
      ];
    }
    const rows = states.map(([module, state]) => this.row(run, module, state));
    return [...title, table('roles', [row(heading('Module'), heading('Role'), heading('Labels and signs'))], rows)];
  }

  private row(run: Run, module: string, state: ModuleState | null): HTMLElement {
    const { context } = this;
    const selected = context.selected?.run === run && context.selected.module === module;
    const select = (): void => context.select(selected ? null : { run, module });
    const pick = button([swatch(context.colourOf(run, module)), module], select, {
      class: 'pick',
      'aria-pressed': selected ? 'true' : 'false',
      title: 'Mark this module in the view',
    });
    return element(
      'tr',
      {
        'data-module': module,
        'data-role': state?.role ?? '',
        class: `${selected ? 'selected' : ''} ${state?.lost ? 'lost' : ''}`.trim(),
      },
      element('td', {}, pick),
      element('td', {}, ...this.role(run, module, state)),
      element('td', { class: 'labels' }, ...(state ? this.labels(state) : [])),
    );
  }

  private role(run: Run, module: string, state: ModuleState | null): (Node | string)[] {
    if (!state) return [element('span', { class: 'quiet' }, 'not heard yet')];
    // Of a lost module only what it was is known.
    if (state.lost) {
      const was = state.role ? ` was ${state.role}` : '';
      return [element('span', { class: 'tag lost' }, 'lost'), element('span', { class: 'quiet' }, was)];
    }
    const remarks: string[] = [];
    if (state.frozen) remarks.push('frozen');
    if (!state.hasPose) remarks.push('no pose');
    else if (state.poseStale) remarks.push('pose is stale');
    if (state.incarnation > 1) remarks.push(`start ${state.incarnation}`);
    const dead = endedText(state);
    const tasks = state.tasks.map((task) => task.function.split('.').pop() ?? task.function).join(', ');
    return [
      state.role ? element('span', { class: 'role-name' }, ...breakable(state.role)) : element('span', { class: 'quiet' }, 'no role'),
      ...(remarks.length ? [element('span', { class: 'remark' }, ` ${remarks.join(', ')}`)] : []),
      ...(tasks ? [element('div', { class: 'tasks', title: 'What it runs now' }, tasks)] : []),
      ...(state.role ? [] : this.missing(run, module)),
      ...(dead ? [element('div', { class: 'remark', title: 'Not run again while it has this role' }, dead)] : []),
    ];
  }

  /** Why it has no role: first of the role that it had, then of the others, in the program's order. */
  private missing(run: Run, module: string): HTMLElement[] {
    const { session, time } = this.context;
    const all = session.roleQuestions.missing(run, module, time) ?? [];
    const had = run.roleBefore(module, time);
    const first = all.findIndex(({ text }) => text.startsWith(`not ${had}:`));
    const [shown, ...rest] = first > 0 ? [all[first], ...all.filter((_, i) => i !== first)] : all;
    if (!shown) return [];
    const line = (missing: RoleFinding): HTMLElement =>
      element(
        'div',
        { class: 'missing-role' },
        `${missing.text} `,
        missing.line > 0 &&
          button(
            `${(missing.file || run.description.program).split('/').pop() || 'program'}:${missing.line}`,
            () => this.context.showSource(run, { module, file: missing.file, line: missing.line }),
            { class: 'place', title: 'Show the program at this line' },
          ),
      );
    return [
      line(shown),
      ...(rest.length
        ? [element('details', {}, element('summary', {}, `and ${rest.length} more`), ...rest.map(line))]
        : []),
    ];
  }

  private labels(state: ModuleState): HTMLElement[] {
    const chips = state.labels.map((label) =>
      element(
        'span',
        { class: `label ${label.kind}` },
        label.name,
        element('span', { class: 'target' }, label.target),
        label.kind === 'joint' && element('b', { class: 'sign', title: signTitle(label.sign) }, signText(label.sign)),
      ),
    );
    // Joints that have a convention but no label.
    const labelled = new Set(state.labels.filter((l) => l.kind === 'joint').map((l) => l.target));
    for (const { joint, sign } of state.signs) {
      if (!labelled.has(joint)) {
        chips.push(
          element(
            'span',
            { class: 'label joint' },
            element('span', { class: 'target' }, joint),
            element('b', { class: 'sign', title: signTitle(sign) }, signText(sign)),
          ),
        );
      }
    }
    return chips;
  }
}
