/** A value of any structure as a tree that folds. */

import { element } from './dom.ts';

/** Elements of a list that are shown at most. */
const SHOWN = 100;

function plainText(value: unknown): string {
  if (typeof value === 'string') return JSON.stringify(value);
  if (typeof value === 'number') return Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(7)));
  return String(value);
}

/** `name` with its value; what has parts is folded unless `open`. Fields whose names begin with "$" are the decoder's own. */
export function tree(name: string, value: unknown, open = false): HTMLElement {
  const label = element('span', { class: 'tree-name' }, name);
  if (value === null || typeof value !== 'object') {
    return element('div', { class: 'tree-leaf' }, label, element('span', { class: 'tree-value' }, plainText(value)));
  }
  const parts = Object.entries(value).filter(([key]) => !key.startsWith('$'));
  const details = element('details', { open }, element('summary', {}, label, ` ${Array.isArray(value) ? `[${parts.length}]` : ''}`));
  // Parts are made when they are first looked at: a message may be large.
  const unfold = (): void => {
    if (!details.open || details.childElementCount > 1) return;
    details.append(...parts.slice(0, SHOWN).map(([key, part]) => tree(key, part)));
    if (parts.length > SHOWN) details.append(element('div', { class: 'quiet' }, `and ${parts.length - SHOWN} more`));
  };
  details.addEventListener('toggle', unfold);
  unfold();
  return details;
}
