/** Small helpers to make and fill elements. */

type Child = Node | string | number | null | undefined | false;
export type Attributes = Record<string, string | number | boolean | null | undefined | ((event: any) => void)>;

/** An element with attributes, listeners (names that begin with "on") and children. */
export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === 'function') made.addEventListener(name.slice(2), value);
    else made.setAttribute(name, value === true ? '' : String(value));
  }
  append(made, children);
  return made;
}

function append(parent: Element, children: readonly Child[]): void {
  for (const child of children) {
    if (child === null || child === undefined || child === false || child === '') continue;
    parent.append(child instanceof Node ? child : String(child));
  }
}

/** Replaces what an element holds. */
export function fill(parent: Element, ...children: Child[]): void {
  parent.replaceChildren();
  append(parent, children);
}

/** Sets the text if it is another one, so that the browser has nothing to do if not. */
export function setText(node: Node, text: string): void {
  if (node.textContent !== text) node.textContent = text;
}

/** A name that may be broken before its capital letters, where it does not fit on a line. */
export function breakable(name: string): Node[] {
  return name
    .split(/(?<=[a-z0-9_.])(?=[A-Z])/)
    .flatMap((part, i) => (i ? [element('wbr'), document.createTextNode(part)] : [document.createTextNode(part)]));
}

/** A square in a colour, beside the name that it stands for. */
export function swatch(colour: string): HTMLElement {
  const square = element('span', { class: 'swatch', 'aria-hidden': 'true' });
  square.style.background = colour;
  return square;
}

/** A button with what it holds: a text, or a symbol whose meaning the attributes tell. */
export function button(
  content: Child | readonly Child[],
  onclick: () => void,
  attributes: Attributes = {},
): HTMLButtonElement {
  return element('button', { type: 'button', onclick, ...attributes }, ...[content].flat());
}

/** A box for a number, 0 or more, unless the attributes say otherwise; `label` tells people what it is. */
export function numberInput(label: string, value: number, attributes: Attributes = {}): HTMLInputElement {
  return element('input', { type: 'number', min: 0, step: 'any', value, 'aria-label': label, ...attributes });
}

/** A table: rows of headings, and the rows below them. */
export function table(kind: string, head: readonly HTMLElement[], rows: readonly HTMLElement[]): HTMLElement {
  return element('table', { class: `list ${kind}` }, element('thead', {}, ...head), element('tbody', {}, ...rows));
}

export function row(...cells: Child[]): HTMLElement {
  return element('tr', {}, ...cells);
}

/** A heading of a column. */
export function heading(text: string, attributes: Attributes = {}): HTMLElement {
  return element('th', { scope: 'col', ...attributes }, text);
}

/** A cell with a number; `warn` marks one that should be another. */
export function numberCell(text: string, warn = false): HTMLElement {
  return element('td', { class: `number${warn ? ' warn' : ''}` }, text);
}

/** Hands a file to the user, as a download. */
export function saveFile(name: string, content: Blob): void {
  const url = URL.createObjectURL(content);
  element('a', { href: url, download: name }).click();
  // The browser has taken it by the next turn.
  setTimeout(() => URL.revokeObjectURL(url), 0);
}

/** A dialog, which is closed at first; `label` is its name for those who do not see it. */
export function dialog(kind: string, label: string, ...children: Child[]): HTMLDialogElement {
  const made = element('dialog', { class: kind, 'aria-label': label }, ...children);
  document.body.append(made);
  return made;
}
