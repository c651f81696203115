/** Acting on a live run: hold, step, speed, push, invoke, deploy. Every order is answered with the tick of its effect. */

import type { Decoded } from '../protocol/decoder.ts';
import type { Run } from '../model/run.ts';
import { timeText } from '../plot/ticks.ts';
import { runTitle, type Context, type Panel } from './context.ts';
import { button, element, fill, numberInput, setText } from './dom.ts';

/** Answers that stay listed. */
const LISTED = 30;

const DIRECTIONS = ['NORTH', 'SOUTH', 'EAST', 'WEST', 'UP', 'DOWN'];

export class ControlPanel implements Panel {
  readonly element = element('div', { class: 'panel-body control' });
  private readonly why = element('p', { class: 'empty' });
  private readonly forms = element('div');
  private readonly answers = element('ol', { class: 'answers', 'aria-live': 'polite', 'aria-label': 'Answers' });
  private readonly runSelect = element('select', { 'aria-label': 'Run to act on' });
  private readonly state = element('output', { class: 'run-state' });
  private readonly stepTicks = numberInput('Ticks', 1, { min: 1, max: 100000, step: 1 });
  private readonly speed = numberInput('Speed, times real time; 0 is as fast as possible', 1);
  private readonly pushBody = element('select', { 'aria-label': 'Module to push' });
  private readonly pushDirection = element(
    'select',
    { 'aria-label': 'Direction' },
    ...DIRECTIONS.map((d) => element('option', {}, d)),
  );
  private readonly pushForce = numberInput('Force in newtons', 5);
  private readonly pushTime = numberInput('Duration in seconds', 0.2);
  private readonly invokeCommand = element('select', { 'aria-label': 'Command' });
  private readonly invokeArguments = element('input', {
    type: 'text',
    placeholder: 'arguments',
    'aria-label': 'Arguments, with blanks between them',
  });
  private readonly invokeTo = element('select', { 'aria-label': 'Module that issues it' });
  private readonly deployName = element('input', {
    type: 'text',
    value: 'program.dyn',
    'aria-label': 'Name of the program',
  });
  private readonly deployTo = element('select', { 'aria-label': 'Module that gets it first' });
  private readonly program = element('textarea', {
    rows: 12,
    spellcheck: 'false',
    'aria-label': 'Text of the program',
    placeholder: 'role … extends Module { … }',
  });
  private readonly parameters = element('div', { class: 'parameters' });
  private readonly raw = element('input', {
    type: 'text',
    placeholder: 'e.g. disconnect m2.c3',
    'aria-label': 'Any command of morphbus control',
    'data-field': 'raw',
  });
  private shown = '';
  private edited = false;

  constructor(private readonly context: Context) {
    this.program.addEventListener('input', () => (this.edited = true));
    this.runSelect.addEventListener('change', () => {
      this.shown = '';
      this.edited = false;
    });
    this.makeForms();
    this.element.append(this.why, this.forms, element('h3', {}, 'Answers'), this.answers);
    fill(
      this.answers,
      element('li', { class: 'empty' }, 'Orders and the ticks at which they took effect are listed here.'),
    );
  }

  /** The live run that is acted on; null if there is none. */
  get run(): Run | null {
    const live = this.context.session.runs.filter((run) => run.kind === 'live');
    return live.find((run) => run.name === this.runSelect.value) ?? live[0] ?? null;
  }

  /** Gives a command in the words of `morphbus control`. */
  give(words: string): void {
    const run = this.run;
    if (run) this.await(words, this.context.session.command(run, words));
  }

  /** Holds the run between two ticks, or lets it go on. */
  toggleRun(): void {
    if (this.run && this.context.session.mayControl) this.give(this.run.clock.paused ? 'resume' : 'pause');
  }

  update(): void {
    const { session } = this.context;
    const live = session.runs.filter((run) => run.kind === 'live');
    const run = this.run;
    const reason = !live.length
      ? 'This is a log: what is in it has happened. The time line below plays it.'
      : !session.mayControl
        ? 'This page may only watch. To act on the run, open the URL that morphbus monitor has printed, with its token.'
        : session.state !== 'connected'
          ? 'There is no connection.'
          : run?.clock.ended
            ? `The run is over${run.clock.endReason ? `: ${run.clock.endReason}` : ''}.`
            : '';
    setText(this.why, reason);
    this.why.hidden = reason === '';
    // A program can be read where it cannot be sent.
    this.forms.hidden = !run;
    for (const fieldset of this.forms.querySelectorAll('fieldset')) fieldset.disabled = reason !== '';
    if (run)
      setText(
        this.state,
        `${run.clock.paused ? 'paused' : 'running'} at tick ${Math.max(0, run.clock.tick)}, ${timeText(run.clock.time)}`,
      );
    this.fillChoices(live, run);
  }

  private fillChoices(live: readonly Run[], run: Run | null): void {
    const key = JSON.stringify([
      live.map((r) => r.name),
      run?.name,
      run?.moduleNames,
      run?.description.roles,
      run?.description.program,
      run?.description.parameters,
    ]);
    if (key === this.shown || !run) return;
    this.shown = key;
    fill(
      this.runSelect,
      ...live.map((r) => element('option', { value: r.name, selected: r === run }, runTitle(this.context, r))),
    );
    this.runSelect.hidden = live.length < 2;
    const modules = run.moduleNames;
    const options = (first: string | null): HTMLOptionElement[] => [
      ...(first === null ? [] : [element('option', { value: '' }, first)]),
      ...modules.map((m) => element('option', { value: m }, m)),
    ];
    fill(this.pushBody, ...options(null));
    fill(this.invokeTo, ...options('root'));
    fill(this.deployTo, ...options('root'));
    fill(
      this.invokeCommand,
      ...run.description.roles.flatMap((role) =>
        role.commands.map((c) =>
          element('option', { value: `${role.name}.${c.name}` }, `${role.name}.${c.name}(${c.parameterTypes.join(', ')})`),
        ),
      ),
    );
    this.fillParameters(run);
    if (!this.edited) {
      this.program.value = run.description.programText;
      this.deployName.value = run.description.program.split('/').pop() || 'program.dyn';
    }
  }

  /** A slider for each parameter; what is chosen is set in all modules at one tick. */
  private fillParameters(run: Run): void {
    // A slider that is being dragged is not taken away; the next change of what is known fills it in.
    if (this.parameters.contains(document.activeElement) && document.activeElement?.matches(':active')) {
      this.shown = '';
      return;
    }
    const { parameters } = run.description;
    this.parameters.closest('form')!.hidden = !parameters.length;
    fill(
      this.parameters,
      ...parameters.map((p) => {
        const range = { min: p.least, max: p.most, step: p.isInt ? 1 : 'any', value: p.value };
        const number = numberInput(p.name, p.value, { ...range, required: true });
        const slider = element('input', { type: 'range', ...range, 'aria-label': `${p.name}, slider` });
        // A hand chooses a thousandth of the range; both its ends are reached.
        const step = 10 ** Math.floor(Math.log10((p.most - p.least || 1) / 1000));
        const rounded = (): string => {
          const value = Number(slider.value);
          if (p.isInt || value === p.least || value === p.most) return slider.value;
          const near = Number((Math.round(value / step) * step).toPrecision(9));
          return String(Math.min(p.most, Math.max(p.least, near)));
        };
        slider.addEventListener('input', () => (number.value = rounded()));
        slider.addEventListener('change', () => this.give(`set ${p.name} ${rounded()}`));
        number.addEventListener('change', () => number.value && this.give(`set ${p.name} ${number.value}`));
        return element('label', { class: 'row' }, element('span', {}, p.name), slider, number);
      }),
    );
  }

  private makeForms(): void {
    const form = (legend: string, action: () => void, ...parts: Node[]): HTMLElement => {
      const onsubmit = (event: Event): void => {
        event.preventDefault();
        action();
      };
      const head = element('legend', {}, legend);
      return element(
        'form',
        { onsubmit },
        element('fieldset', { 'data-form': legend.toLowerCase() }, head, ...parts),
      );
    };
    /** One command, with a button at its end that gives it. */
    const order = (legend: string, action: () => void, submit: string, ...parts: Node[]): HTMLElement => {
      const give = element('button', { type: 'submit', class: 'primary' }, submit);
      return form(legend, action, element('div', { class: 'row' }, ...parts, give));
    };
    const unit = (text: string): HTMLElement => element('span', { class: 'quiet' }, text);
    const file = element('input', {
      type: 'file',
      accept: '.dyn,text/plain',
      'aria-label': 'Read the program from a file',
      onchange: () => void this.readFile(file),
    });
    fill(
      this.forms,
      this.runSelect,
      form(
        'Run',
        () => {},
        this.state,
        element(
          'div',
          { class: 'row' },
          button('Pause run', () => this.give('pause'), {
            title: 'Hold the simulation between two ticks (Shift+space)',
          }),
          button('Resume run', () => this.give('resume'), { title: 'Let it go on (Shift+space)' }),
          this.stepTicks,
          button('Step', () => this.give(`step ${this.stepTicks.value || 1}`), {
            title: 'Run so many ticks, then hold',
          }),
          this.speed,
          unit('×'),
          button('Set speed', () => this.give(`speed ${this.speed.value || 1}`), {
            title: 'Times real time; 0: as fast as possible',
          }),
        ),
      ),
      order(
        'Push',
        () =>
          this.give(
            `push ${this.pushBody.value} ${this.pushDirection.value} ${this.pushForce.value} ${this.pushTime.value}`,
          ),
        'Push',
        this.pushBody,
        this.pushDirection,
        this.pushForce,
        unit('N'),
        this.pushTime,
        unit('s'),
      ),
      order(
        'Invoke',
        () => this.invoke(),
        'Invoke',
        this.invokeCommand,
        this.invokeArguments,
        unit('to'),
        this.invokeTo,
      ),
      form('Parameters', () => {}, this.parameters),
      order('Deploy', () => this.deploy(), 'Deploy', this.program, file, this.deployName, unit('to'), this.deployTo),
      order('Other command', () => this.raw.value.trim() && this.give(this.raw.value.trim()), 'Give', this.raw),
    );
  }

  private async readFile(input: HTMLInputElement): Promise<void> {
    const file = input.files?.[0];
    if (!file) return;
    this.program.value = await file.text();
    this.deployName.value = file.name;
    this.edited = true;
  }

  private invoke(): void {
    if (!this.invokeCommand.value) {
      this.list('invoke', 'The program has no commands.', true);
      return;
    }
    const to = this.invokeTo.value ? ` --to ${this.invokeTo.value}` : '';
    this.give(`invoke ${this.invokeCommand.value} ${this.invokeArguments.value.trim()}${to}`.replace(/\s+/g, ' '));
  }

  private deploy(): void {
    const run = this.run;
    if (!run) return;
    const name = this.deployName.value.trim() || 'program.dyn';
    this.await(`deploy ${name}`, this.context.session.deploy(run, name, this.program.value, this.deployTo.value));
  }

  private await(words: string, answer: Promise<Decoded>): void {
    answer.then(
      (a) => this.list(words, describe(a), false),
      (error: Error) => this.list(words, error.message, true),
    );
  }

  private list(words: string, text: string, failed: boolean): void {
    this.answers.querySelector('.empty')?.remove();
    this.answers.prepend(
      element(
        'li',
        { class: failed ? 'failed' : '' },
        element('b', { class: 'mono' }, words),
        element('pre', {}, text),
      ),
    );
    while (this.answers.children.length > LISTED) this.answers.lastElementChild?.remove();
    this.context.tell(`${words}: ${text.split('\n')[0]}`, failed ? 'error' : 'info');
  }
}

/** The answer of `morphbus control --json` in a sentence. */
function describe(answer: Decoded): string {
  if (typeof answer.text === 'string') return answer.text;
  if (answer.pending) return `will take effect at tick ${answer.tick}, once the run gets there`;
  // A program, and a parameter's value, reach all modules before they hold.
  if (typeof answer.switch_seconds === 'number') return `holds everywhere from ${answer.switch_seconds} s on`;
  if (typeof answer.tick === 'number') return `took effect at tick ${answer.tick}`;
  return 'done';
}
