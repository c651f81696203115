/** The bar at the top: what is shown, whether the page is connected, theme and help. */

import type { Run } from '../model/run.ts';
import { runTitle, type Context } from './context.ts';
import { button, element, fill, setText } from './dom.ts';
import { iconButton } from './icons.ts';

/** How long a note stays, milliseconds. */
const NOTICE_TIME = 8000;

export class HeaderBar {
  readonly element: HTMLElement;
  private readonly sources = element('div', { class: 'sources' });
  private readonly connection = button('', () => this.context.session.connection.connect(), {
    class: 'connection',
    'data-field': 'connection',
  });
  private readonly notice = element('div', { class: 'notice', role: 'status', 'aria-live': 'polite', hidden: true });
  private noticeTimer = 0;
  private readonly banner = element('div', { class: 'banner', role: 'alert', hidden: true });
  private shown = '';
  private connectionKey = '';

  constructor(
    private readonly context: Context,
    theme: () => void,
    help: () => void,
    layouts: () => void,
  ) {
    this.element = element(
      'header',
      { class: 'bar' },
      element('h1', {}, 'Morphbus ', element('span', {}, 'monitor')),
      this.sources,
      this.notice,
      this.connection,
      iconButton('layout', 'Layouts: save, bring back, pass on (L)', layouts, { class: 'icon-button', 'data-action': 'layouts' }),
      iconButton('theme', 'Dark or light (D)', theme, { class: 'icon-button', 'data-action': 'theme' }),
      iconButton('help', 'Help and keys (?)', help, { class: 'icon-button', 'data-action': 'help' }),
      this.banner,
    );
  }

  /** Tells something in a line of the bar, in place of what was told before, for a while. */
  tell(text: string, kind: 'info' | 'error'): void {
    const drop = (): void => {
      this.notice.hidden = true;
    };
    this.notice.hidden = false;
    this.notice.className = `notice ${kind}`;
    fill(
      this.notice,
      element('span', { class: 'text', title: text }, text),
      iconButton('close', 'Close this note', drop, { class: 'small' }),
    );
    clearTimeout(this.noticeTimer);
    this.noticeTimer = window.setTimeout(drop, NOTICE_TIME);
  }

  update(): void {
    const { session } = this.context;
    const runs = session.runs.map((run) => [runTitle(this.context, run), this.facts(run)] as const);
    const key = JSON.stringify(runs);
    if (key !== this.shown) {
      this.shown = key;
      fill(
        this.sources,
        ...runs.map(([title, facts], i) =>
          element(
            'span',
            {
              class: `source run-${session.runs[i].letter.toLowerCase()}`,
              title: [session.runs[i].file || session.runs[i].name, session.runs[i].damage?.what].filter(Boolean).join(': '),
            },
            element('b', {}, title),
            element('span', { class: `facts${session.runs[i].damage ? ' warn' : ''}` }, facts),
          ),
        ),
      );
      document.title = runs.length
        ? `${runs.map(([title]) => title).join(' and ')} – Morphbus monitor`
        : 'Morphbus monitor';
    }
    this.showConnection();
  }

  private facts(run: Run): string {
    const { clock, description } = run;
    const state = run.kind === 'log' ? this.logState(run) : clock.ended ? 'over' : clock.paused ? 'paused' : 'live';
    return [description.robot, state].filter(Boolean).join(', ');
  }

  private logState(run: Run): string {
    const share = this.context.session.loaded(run);
    const { damage } = run;
    if (share >= 1 && damage)
      return `log, ${damage.cut ? `cut at ${damage.time.toFixed(2)} s` : `damaged from ${damage.time.toFixed(2)} s on`}`;
    return share >= 1 ? 'log' : `log, ${Math.floor(share * 100)} % read`;
  }

  private showConnection(): void {
    const { state, retryIn, informed } = this.context.session;
    const key = `${state} ${retryIn} ${informed}`;
    if (key === this.connectionKey) return;
    this.connectionKey = key;
    this.connection.dataset.state = state;
    setText(
      this.connection,
      state === 'connected' ? 'connected' : state === 'connecting' ? 'connecting …' : 'disconnected',
    );
    this.connection.title = state === 'connected' ? 'The page is connected to the monitor' : 'Try now';
    this.connection.disabled = state === 'connected';
    // At first the message in the view says it.
    this.banner.hidden = state === 'connected' || !informed;
    setText(
      this.banner,
      'The connection to the monitor is lost. What was received can still be looked at. The page tries again by itself; if the monitor has ended, start it again.',
    );
  }
}
