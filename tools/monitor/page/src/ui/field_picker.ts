/** A dialog in which fields to plot are found by typing parts of their names. */

import { allFields, matchFields, type Field } from '../model/fields.ts';
import type { Session } from '../model/session.ts';
import { button, dialog, element, fill } from './dom.ts';

/** Fields that are listed at most; whoever wants another types more of its name. */
const LISTED = 300;

export class FieldPicker {
  readonly dialog: HTMLDialogElement;
  private readonly search = element('input', {
    type: 'search',
    placeholder: 'e.g. knee velocity, or foot y',
    'aria-label': 'Parts of the field’s name',
    oninput: () => this.list(),
  });
  private readonly results = element('div', { class: 'results', role: 'group', 'aria-label': 'Fields' });
  private readonly count = element('p', { class: 'quiet', role: 'status' });
  private fields: Field[] = [];
  private chosen = new Set<string>();
  private done: (ids: string[]) => void = () => {};

  constructor(private readonly session: Session) {
    this.dialog = dialog(
      'picker',
      'Fields to plot',
      element(
        'form',
        { method: 'dialog', onsubmit: () => this.done([...this.chosen]) },
        element('h2', {}, 'Fields to plot'),
        this.search,
        this.count,
        this.results,
        element(
          'div',
          { class: 'row end' },
          button('Cancel', () => this.dialog.close()),
          element('button', { type: 'submit', class: 'primary' }, 'Plot'),
        ),
      ),
    );
  }

  /** Lets the user choose, and calls `done` with the ids of what is chosen then. */
  open(chosen: readonly string[], done: (ids: string[]) => void): void {
    this.chosen = new Set(chosen);
    this.done = done;
    this.fields = allFields(this.session);
    this.search.value = '';
    this.list();
    this.dialog.showModal();
    this.search.focus();
  }

  private list(): void {
    const matching = matchFields(this.fields, this.search.value);
    const picked = matching.filter((f) => this.chosen.has(f.id));
    const rest = matching.filter((f) => !this.chosen.has(f.id));
    const shown = [...picked, ...rest].slice(0, LISTED);
    this.count.textContent =
      this.fields.length === 0
        ? 'No messages have come yet, so there is nothing to plot.'
        : `${matching.length} of ${this.fields.length} fields${matching.length > shown.length ? `, the first ${shown.length} are listed` : ''}`;
    const several = this.session.runs.length > 1;
    fill(
      this.results,
      ...shown.map((field) => {
        const box = element('input', {
          type: 'checkbox',
          checked: this.chosen.has(field.id),
          onchange: () => this.toggle(field.id, box.checked),
        });
        return element(
          'label',
          { class: 'field' },
          box,
          element('span', { class: 'where' }, `${several && field.run ? `${field.run} · ` : ''}${field.table}`),
          element('span', { class: 'what' }, field.name),
          field.unit && element('span', { class: 'quiet' }, field.unit),
        );
      }),
    );
  }

  private toggle(id: string, on: boolean): void {
    if (on) this.chosen.add(id);
    else this.chosen.delete(id);
  }
}
