/** A dialog that shows a program with one line marked. */

import { button, dialog, element, fill } from './dom.ts';

export class SourceDialog {
  private readonly title = element('h2');
  private readonly lines = element('pre', { class: 'program', tabindex: 0 });
  private readonly dialog: HTMLDialogElement;

  constructor() {
    this.dialog = dialog(
      'source-dialog',
      'Program',
      this.title,
      this.lines,
      element(
        'div',
        { class: 'row end' },
        button('Close', () => this.dialog.close()),
      ),
    );
  }

  /** Shows `text` with line `line`, from 1, in the middle. */
  open(name: string, text: string, line: number): void {
    this.title.textContent = `${name}:${line}`;
    const rows = text
      .split('\n')
      .map((content, i) =>
        element('span', { class: i + 1 === line ? 'line marked' : 'line', 'data-line': i + 1 }, `${content}\n`),
      );
    fill(this.lines, ...rows);
    this.dialog.showModal();
    rows[line - 1]?.scrollIntoView({ block: 'center' });
  }
}
