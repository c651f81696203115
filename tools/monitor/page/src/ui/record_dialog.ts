/** The dialog that asks what to record. */

import type { RecordingPlan } from '../record/recording.ts';
import type { Context } from './context.ts';
import { button, dialog, element, numberInput } from './dom.ts';

export class RecordDialog {
  private readonly dialog: HTMLDialogElement;
  private readonly plots = element('input', { type: 'checkbox', name: 'plots' });
  private readonly from = numberInput('From, seconds of sim time', 0, { name: 'from' });
  private readonly to = numberInput('To, seconds of sim time', 0, { name: 'to' });
  private readonly stretch = element('div', { class: 'row' }, 'From', this.from, 's to', this.to, 's');
  private readonly how = element('p', { class: 'quiet' });

  constructor(
    private readonly context: Context,
    start: (plan: RecordingPlan) => void,
  ) {
    this.dialog = dialog(
      'record-dialog',
      'Record a video',
      element('h2', {}, 'Record a video'),
      this.how,
      element(
        'form',
        {
          onsubmit: (event: Event) => {
            event.preventDefault();
            this.dialog.close();
            start(this.plan());
          },
        },
        this.stretch,
        element('label', { class: 'row' }, this.plots, 'with the plots below the view'),
        element(
          'div',
          { class: 'row end' },
          element('button', { type: 'submit', class: 'primary', autofocus: true }, 'Record'),
          button('Close', () => this.dialog.close()),
        ),
      ),
    );
  }

  open(): void {
    const { session, clock, time } = this.context;
    const { begin, end } = session.span();
    this.stretch.hidden = !this.ofLogs();
    this.how.textContent = this.ofLogs()
      ? `What the view shows, at the speed of the time line (${clock.speed}×). The page goes through the log picture by picture, so that the video is smooth however slow the drawing is.`
      : 'What the view shows from now on, until it is stopped or the run ends.';
    for (const box of [this.from, this.to]) Object.assign(box, { min: begin.toFixed(2), max: end.toFixed(2) });
    // At the log's end there is nothing to come.
    this.from.value = (time < end - 0.1 ? time : begin).toFixed(2);
    this.to.value = end.toFixed(2);
    this.dialog.showModal();
  }

  /** Whether all that is shown is over, and can be gone through again. */
  private ofLogs(): boolean {
    return this.context.session.runs.every((run) => run.kind === 'log');
  }

  private plan(): RecordingPlan {
    const [from, to] = [this.from, this.to].map((box) => Number(box.value));
    const stretch = this.ofLogs() ? { from: Math.min(from, to), to: Math.max(from, to) } : null;
    return { plots: this.plots.checked, stretch };
  }
}
