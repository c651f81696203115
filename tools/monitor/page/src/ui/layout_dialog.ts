/** The dialog in which layouts are saved, brought back, and passed on as a link. */

import { button, dialog, element, fill } from './dom.ts';
import { savedLayouts, saveLayout, type Layout } from './layout.ts';

export class LayoutDialog {
  private readonly dialog: HTMLDialogElement;
  private readonly list = element('ul', { class: 'layouts' });
  private readonly name = element('input', { type: 'text', 'aria-label': 'Name of the layout', placeholder: 'Name', required: true });

  /** @param current what the page shows; @param apply shows something else; @param link the URL of what it shows. */
  constructor(
    private readonly current: () => Layout,
    private readonly apply: (layout: Layout) => void,
    private readonly link: () => string,
    private readonly tell: (text: string) => void,
  ) {
    this.dialog = dialog(
      'layout-dialog',
      'Layouts',
      element('h2', {}, 'Layouts'),
      element('p', { class: 'quiet' }, 'View, camera, plots and their length, and the list at the side, kept in this browser. The address of the page always says what it shows, with the instant.'),
      this.list,
      element(
        'form',
        {
          class: 'row',
          onsubmit: (event: Event) => {
            event.preventDefault();
            this.save();
          },
        },
        this.name,
        element('button', { type: 'submit', class: 'primary' }, 'Save'),
        button('Copy link', () => this.copy(), { 'data-action': 'copy-link' }),
        element('span', { class: 'spring' }),
        button('Close', () => this.dialog.close()),
      ),
    );
  }

  open(): void {
    this.show();
    this.dialog.showModal();
    this.name.focus();
  }

  private save(): void {
    // A layout is of any time.
    const { time: _, selected: __, ...layout } = this.current();
    saveLayout(this.name.value.trim(), layout);
    this.name.value = '';
    this.show();
  }

  private show(): void {
    const rows = Object.entries(savedLayouts()).map(([name, layout]) => {
      const use = (): void => {
        this.dialog.close();
        this.apply(layout);
      };
      const forget = (): void => {
        saveLayout(name, null);
        this.show();
      };
      return element('li', { class: 'row' }, button(name, use, { class: 'name' }), button('Forget', forget));
    });
    fill(this.list, ...(rows.length ? rows : [element('li', { class: 'quiet' }, 'None has been saved.')]));
  }

  private copy(): void {
    const url = this.link();
    navigator.clipboard.writeText(url).then(
      () => this.tell('The link is in the clipboard.'),
      () => this.tell(`The browser keeps the clipboard; the link is ${url}`),
    );
    this.dialog.close();
  }
}
