/** Two runs beside each other: by how much their labelled links lie apart now and at most. */

import { timeText, valueText } from '../plot/ticks.ts';
import { displayUnit, type Context, type Panel } from './context.ts';
import { button, element, fill, heading, numberCell, row, table } from './dom.ts';

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

  /** A pair's name, which selects A's module. */
  private pair(name: string): HTMLElement | string {
    const { pairs, runs } = this.context.session;
    const pair = pairs.find((p) => p.name === name);
    if (!pair) return name;
    const select = (): void => this.context.select({ run: runs[0], module: pair.moduleA });
    return button(name, select, { class: 'pick', title: `Select ${pair.moduleA} of A (B: ${pair.moduleB})` });
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
    const cell = (value: number, scale: number): HTMLElement => numberCell(valueText(value * scale));
    const number = { class: 'number' };
    const plot = (quantity: string) => (): void => this.plot(difference.pairNames.map((name) => `${name} ${quantity}`));
    fill(
      this.body,
      element(
        'p',
        { class: 'quiet' },
        `Distance of links with the same label, and the turn between them, since ${timeText(difference.reference)}. ` +
          'Links are matched by role and label; each position is that of the same point of both robots.',
      ),
      table(
        'compare',
        [
          row(
            heading('Role.label', { rowspan: 2 }),
            heading('Position, mm', { scope: 'colgroup', colspan: 2, ...number }),
            heading(`Rotation, ${rotation.unit}`, { scope: 'colgroup', colspan: 2, ...number }),
          ),
          row(...['now', 'most', 'now', 'most'].map((text) => heading(text, number))),
        ],
        rows.map(([name, p, pMost, r, rMost]) =>
          row(
            element('td', {}, this.pair(name)),
            cell(p, 1000),
            cell(pMost, 1000),
            cell(r, rotation.scale),
            cell(rMost, rotation.scale),
          ),
        ),
      ),
      element(
        'div',
        { class: 'row' },
        button('Plot positions', plot('position')),
        button('Plot rotations', plot('rotation')),
      ),
    );
  }
}
