/** The time line: which instant of the past minutes is shown, and how it moves on. */

import { SPEEDS } from '../model/view_clock.ts';
import { timeText } from '../plot/ticks.ts';
import type { Context, Panel } from './context.ts';
import { button, element, setText } from './dom.ts';
import { icon, iconButton } from './icons.ts';
import { TimelineMarks } from './timeline_marks.ts';

/** The slider counts in milliseconds. */
const MS = 1000;

export class Timeline implements Panel {
  readonly element: HTMLElement;
  private readonly slider = element('input', {
    type: 'range',
    min: 0,
    max: 1,
    step: 1,
    value: 0,
    'aria-label': 'Instant that is shown',
    disabled: true,
  });
  private readonly marks: TimelineMarks;
  private readonly playButton = button('', () => this.togglePlay(), { class: 'transport', 'data-action': 'play' });
  private readonly liveButton = button('Live', () => this.context.clock.follow(), {
    class: 'live',
    'data-action': 'live',
  });
  private readonly now = element('output', { class: 'now', 'data-field': 'time' }, '–');
  private readonly detail = element('span', { class: 'detail', 'data-field': 'behind' }, '');
  private readonly begin = element('span', { class: 'edge' });
  private readonly end = element('span', { class: 'edge' });
  private readonly speed = element(
    'select',
    { 'aria-label': 'Speed of playing', onchange: () => (this.context.clock.speed = Number(this.speed.value)) },
    ...SPEEDS.map((s) => element('option', { value: s, selected: s === 1 }, `${s}×`)),
  );
  private playing: boolean | null = null;
  private dragging = false;

  constructor(private readonly context: Context) {
    const symbol = (name: 'stepBack' | 'stepForward' | 'start', title: string, action: () => void): HTMLElement =>
      iconButton(name, title, action, { class: 'transport', 'data-action': name });
    this.marks = new TimelineMarks(context, this.slider);
    this.slider.addEventListener('input', () => {
      this.dragging = true;
      this.context.seek(Number(this.slider.value) / MS);
    });
    this.slider.addEventListener('change', () => (this.dragging = false));
    this.element = element(
      'footer',
      { class: 'timeline', 'aria-label': 'Time line' },
      element(
        'div',
        { class: 'buttons', role: 'group', 'aria-label': 'Playing' },
        symbol('start', 'To the beginning (Home)', () => this.toBegin()),
        symbol('stepBack', 'One tick back (←)', () => this.step(-1)),
        this.playButton,
        symbol('stepForward', 'One tick on (→)', () => this.step(1)),
        this.speed,
        this.liveButton,
      ),
      element('div', { class: 'readout' }, this.now, this.detail),
      element(
        'div',
        { class: 'track' },
        this.begin,
        element('div', { class: 'slider' }, this.marks.canvas, this.slider, this.marks.tip),
        this.end,
      ),
    );
  }

  /** Plays on, or stays where it is. */
  togglePlay(): void {
    const { clock, session } = this.context;
    if (clock.mode !== 'hold') {
      clock.pause();
      return;
    }
    const { begin, end, ended } = session.range();
    // At the end of what is over, playing begins anew.
    if (ended && clock.time >= end - 1e-6) clock.seek(begin);
    clock.play();
  }

  /** One control tick, or `ticks` of them, back (negative) or on. */
  step(ticks: number): void {
    const run = this.context.session.runs.find((r) => r.poses.length);
    if (!run) return;
    const row = run.poses.rowAt(this.context.time + 1e-9) + ticks;
    this.context.seek(run.poses.time(Math.max(0, Math.min(run.poses.length - 1, row))));
  }

  /** By so many seconds. */
  shift(seconds: number): void {
    this.context.seek(this.context.time + seconds);
  }

  toBegin(): void {
    const { begin } = this.context.session.span();
    if (!Number.isNaN(begin)) this.context.seek(begin);
  }

  toEnd(): void {
    const { end, ended } = this.context.session.range();
    if (ended) this.context.seek(end);
    else this.context.clock.follow();
  }

  update(): void {
    const { session, clock, time } = this.context;
    const span = session.span();
    const range = session.range();
    const some = !Number.isNaN(span.end);
    this.slider.disabled = !some;
    this.showButtons(range.ended, some);
    if (!some) return;
    const [min, max] = [Math.floor(span.begin * MS), Math.ceil(span.end * MS)];
    if (Number(this.slider.min) !== min) this.slider.min = String(min);
    if (Number(this.slider.max) !== max) this.slider.max = String(max);
    if (!this.dragging || document.activeElement !== this.slider) this.slider.value = String(Math.round(time * MS));
    this.slider.setAttribute('aria-valuetext', `${time.toFixed(2)} seconds of sim time`);
    const run = session.runs.find((r) => r.poses.length);
    const tick = run ? Math.round(time / run.description.tick) : 0;
    setText(this.now, timeText(time));
    const behind = range.end - time;
    setText(
      this.detail,
      `tick ${tick}${!range.ended && behind > 0.3 && clock.mode !== 'follow' ? ` · ${behind.toFixed(1)} s ago` : ''}`,
    );
    setText(this.begin, timeText(span.begin, 0));
    setText(this.end, timeText(span.end, 0));
    if (Number(this.speed.value) !== clock.speed) this.speed.value = String(clock.speed);
    this.marks.draw(span, range);
  }

  private showButtons(ended: boolean, some: boolean): void {
    const { clock } = this.context;
    const playing = clock.mode !== 'hold';
    if (playing !== this.playing) {
      this.playing = playing;
      this.playButton.replaceChildren(icon(playing ? 'pause' : 'play'));
      const title = playing ? 'Hold the view at this instant (space)' : 'Play on from here (space)';
      this.playButton.title = title;
      this.playButton.setAttribute('aria-label', title);
    }
    this.liveButton.hidden = ended;
    this.liveButton.setAttribute('aria-pressed', clock.mode === 'follow' ? 'true' : 'false');
    this.liveButton.title = clock.mode === 'follow' ? 'The newest instant is shown' : 'Show the newest instant (End)';
    for (const control of this.element.querySelectorAll<HTMLButtonElement>('.buttons button')) control.disabled = !some;
  }
}
