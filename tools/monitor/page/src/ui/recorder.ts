/** Makes videos of what the page shows: the button, the dialog, and the recording that goes on. */

import { beginFilm, type Film } from '../record/film.ts';
import { Picture } from '../record/picture.ts';
import { MOST_BYTES, Recording, type RecordingPlan } from '../record/recording.ts';
import { timeText } from '../plot/ticks.ts';
import type { Context } from './context.ts';
import { button, saveFile, setText } from './dom.ts';
import type { PlotsPanel } from './plots_panel.ts';
import { RecordDialog } from './record_dialog.ts';
import type { ScenePanel } from './scene_panel.ts';

export class Recorder {
  readonly button = button('Record', () => this.toggle(), {
    title: 'Record a video of what is seen (M)',
    'data-action': 'record',
    'aria-pressed': 'false',
  });
  private readonly dialog: RecordDialog;
  private recording: Recording | null = null;

  constructor(
    private readonly context: Context,
    private readonly scene: ScenePanel,
    private readonly plots: PlotsPanel,
  ) {
    this.dialog = new RecordDialog(context, (plan) => {
      this.start(plan).catch((failure: Error) => context.tell(`Nothing is recorded: ${failure.message}`, 'error'));
    });
  }

  /** Whether a recording goes on, for which every frame is to be drawn. */
  get active(): boolean {
    return this.recording !== null;
  }

  /** Asks what to record, or ends what is being recorded. */
  toggle(): void {
    if (this.recording) this.recording.end(null);
    else if (this.scene.view && !Number.isNaN(this.context.time)) this.dialog.open();
    else this.context.tell('There is nothing to record yet.');
  }

  /** Other runs are shown from now on: what was recorded of these ends. */
  stop(): void {
    this.recording?.end(null);
  }

  /** Before a frame of the page, and after all of it was drawn; `now` is a clock of the wall, seconds. */
  lead(): void {
    this.recording?.lead();
  }

  take(now: number): void {
    if (!this.recording) return;
    this.recording.take(now);
    setText(this.button, this.recording ? `Stop ${this.recording.length.toFixed(1)} s` : 'Record');
  }

  private async start(plan: RecordingPlan): Promise<void> {
    const { context, scene, plots } = this;
    const { view } = scene;
    if (!view) return;
    const picture = new Picture(scene.stage, plan.plots ? plots.list : null);
    const film = await beginFilm(picture.canvas);
    const draw = (): void => {
      const { speed } = context.clock;
      picture.draw(`${timeText(context.time)}${speed === 1 || !plan.stretch ? '' : ` · ${speed}×`}`);
    };
    // A log may take its time, and is drawn as finely as the picture is.
    const restore = plan.stretch && film.timed ? view.fix(picture.scale) : (): void => {};
    const begin = plan.stretch?.from ?? context.time;
    this.recording = new Recording(film, plan, context.session, context.clock, draw, (failure) => {
      const { length } = this.recording ?? { length: 0 };
      this.recording = null;
      restore();
      this.showState();
      this.save(film, begin, length, failure).catch((error: Error) =>
        context.tell(`The recording failed: ${error.message}`, 'error'),
      );
    });
    this.showState();
  }

  private showState(): void {
    const { active } = this;
    this.button.setAttribute('aria-pressed', String(active));
    this.button.classList.toggle('recording', active);
    this.button.title = active ? 'Stop recording, and save the video (M)' : 'Record a video of what is seen (M)';
    if (!active) setText(this.button, 'Record');
  }

  private async save(film: Film, begin: number, length: number, failure: Error | null): Promise<void> {
    if (failure) throw failure;
    const { session } = this.context;
    const file = await film.finish();
    const runs = session.runs.map((run) => run.name).join('+');
    const name = `${runs.replace(/[^\w.+-]+/g, '_')}_${begin.toFixed(1)}s.${film.ending}`;
    saveFile(name, file);
    const full = film.bytes > MOST_BYTES ? ', ended because it grew too large' : '';
    this.context.tell(`${name}: ${length.toFixed(1)} s, ${(file.size / 1e6).toFixed(1)} MB${full}.`);
  }
}
