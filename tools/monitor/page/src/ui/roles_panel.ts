/** The list of modules with role, labels, convention signs and tasks, as of the instant that is shown. */

import { endedText, type ModuleState, type Run } from '../model/run.ts';
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
    const key = JSON.stringify([states, selected?.module, selected?.run.name]);
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
      { 'data-module': module, 'data-role': state?.role ?? '', class: selected ? 'selected' : '' },
      element('td', {}, pick),
      element('td', {}, ...this.role(state)),
      element('td', { class: 'labels' }, ...(state ? this.labels(state) : [])),
    );
  }

  private role(state: ModuleState | null): (Node | string)[] {
    if (!state) return [element('span', { class: 'quiet' }, 'not heard yet')];
    const remarks: string[] = [];
    if (state.lost) remarks.push('lost');
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
      ...(dead ? [element('div', { class: 'remark', title: 'Not run again while it has this role' }, dead)] : []),
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
