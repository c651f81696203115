/** The dialog that explains the page and lists its keys. */

import { button, dialog, element } from './dom.ts';

/** Keys and what they do, in groups. */
export const KEYS: [string, [string, string][]][] = [
  [
    'Time',
    [
      ['Space', 'hold the view at this instant, or play on'],
      ['← →', 'one tick back, one tick on'],
      ['Shift ← →', 'one second back, one second on'],
      ['Home / End', 'to the beginning / to the newest instant'],
      ['[ ]', 'play slower / faster'],
    ],
  ],
  [
    'Run (with the token)',
    [
      ['Shift Space', 'pause or resume the run itself'],
      ['.', 'run one control tick'],
    ],
  ],
  [
    'View',
    [
      ['F', 'camera follows the robots'],
      ['R', 'camera back to where it began'],
      ['C', 'colours by role or by module'],
      ['X', 'frames of the selected module'],
      ['O', 'forces: of the ground, of obstacles, of pushes'],
      ['V', 'where modules believe their links to be'],
      ['T', 'trails of labelled links'],
      ['N', 'names of modules'],
      ['G', 'ground'],
      ['B', 'two robots beside or over each other'],
    ],
  ],
  [
    'Page',
    [
      ['1 … 5', 'roles, faults, channels, control, compare'],
      ['P', 'add a plot'],
      ['+ − 0', 'plots: zoom in, out, back'],
      ['M', 'record a video, or stop'],
      ['L', 'layouts: save, bring back, pass on'],
      ['D', 'dark or light'],
      ['?', 'this help'],
      ['Esc', 'close a dialog, drop the selection'],
    ],
  ],
];

export class HelpDialog {
  private readonly dialog: HTMLDialogElement;

  constructor() {
    this.dialog = dialog(
      'help',
      'Help',
      element('h2', {}, 'Morphbus monitor'),
      element(
        'p',
        {},
        'Shows one or two runs, live or from logs. Holding, scrubbing and playing change what is shown; only the buttons under Control, and the keys under Run, act on a robot.',
      ),
      element(
        'div',
        { class: 'keys' },
        ...KEYS.map(([title, keys]) =>
          element(
            'section',
            {},
            element('h3', {}, title),
            element(
              'dl',
              {},
              ...keys.flatMap(([key, what]) => [element('dt', {}, element('kbd', {}, key)), element('dd', {}, what)]),
            ),
          ),
        ),
      ),
      element(
        'p',
        {},
        'In the view, drag to turn, drag with the right button to move, turn the wheel to zoom, click a module to select it. In a plot, click to show that instant, drag over a stretch of time to zoom into it, turn the wheel to zoom, drag with Shift to move, double-click to go back. With fingers: drag to move, pinch to zoom.',
      ),
      element('p', { class: 'quiet' }, element('a', { href: 'licenses.txt' }, 'Licences of the software in this page')),
      element(
        'div',
        { class: 'row end' },
        button('Close', () => this.dialog.close(), { class: 'primary', autofocus: true }),
      ),
    );
  }

  open(): void {
    if (!this.dialog.open) this.dialog.showModal();
  }
}
