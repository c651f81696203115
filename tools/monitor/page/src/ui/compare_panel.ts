/** Two runs beside each other: by how much their labelled links lie apart now and at most. */

import { timeText, valueText } from '../plot/ticks.ts';
import { displayUnit, type Context, type Panel } from './context.ts';
import { element, fill } from './dom.ts';

export class ComparePanel implements Panel {
  readonly element = element('div', { class: 'panel-body' });
  private readonly body = element('div');
  private shown = '';

  /** @param plot shows the differences of these columns in a plot of their own. */
  constructor(
    private readonly context: Context,
    private readonly plot: (columns: string[]) => void,
  ) {
    this.element.append(this.body);
  }

  update(): void {
    const { session, time } = this.context;
    const difference = session.difference;
    if (!difference || !difference.pairNames.length) {
      const key = difference ? 'waiting' : 'none';
      if (key === this.shown) return;
      this.shown = key;
      fill(
        this.body,
        element(
          'p',
          { class: 'empty' },
          difference
            ? 'No labelled links to compare yet. As soon as both robots have roles with the same labels, the distance of those links is shown here.'
            : 'There is one run. Start the monitor with two logs, or with a log and a run, and both are shown side by side here: morphbus monitor A.log B.log',
        ),
      );
      return;
    }
    const rotation = displayUnit('rad', this.context.degrees);
    const rows = difference.pairNames.map((name) => {
      const now = difference.at(name, time);
      return [
        name,
        now?.position ?? NaN,
        difference.maximum(`${name} position`),
        now?.rotation ?? NaN,
        difference.maximum(`${name} rotation`),
      ] as const;
    });
    const key = JSON.stringify([rows, rotation, difference.reference]);
    if (key === this.shown) return;
    this.shown = key;
    const cell = (value: number, scale: number): HTMLElement =>
      element('td', { class: 'number' }, valueText(value * scale));
    fill(
      this.body,
      element(
        'p',
        { class: 'quiet' },
        `Distance of links with the same label, and the turn between them, since ${timeText(difference.reference)}. ` +
          'Links are matched by role and label; each position is that of the same point of both robots.',
      ),
      element(
        'table',
        { class: 'list compare' },
        element(
          'thead',
          {},
          element(
            'tr',
            {},
            element('th', { scope: 'col', rowspan: 2 }, 'Role.label'),
            element('th', { scope: 'colgroup', colspan: 2, class: 'number' }, 'Position, mm'),
            element('th', { scope: 'colgroup', colspan: 2, class: 'number' }, `Rotation, ${rotation.unit}`),
          ),
          element(
            'tr',
            {},
            ...['now', 'most', 'now', 'most'].map((text) => element('th', { scope: 'col', class: 'number' }, text)),
          ),
        ),
        element(
          'tbody',
          {},
          ...rows.map(([name, p, pMost, r, rMost]) =>
            element(
              'tr',
              {},
              element('td', {}, name),
              cell(p, 1000),
              cell(pMost, 1000),
              cell(r, rotation.scale),
              cell(rMost, rotation.scale),
            ),
          ),
        ),
      ),
      element(
        'div',
        { class: 'row' },
        element(
          'button',
          { type: 'button', onclick: () => this.plot(difference.pairNames.map((n) => `${n} position`)) },
          'Plot positions',
        ),
        element(
          'button',
          { type: 'button', onclick: () => this.plot(difference.pairNames.map((n) => `${n} rotation`)) },
          'Plot rotations',
        ),
      ),
    );
  }
}
