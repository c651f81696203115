/** Icons as paths in a square of 16 units, drawn in the colour of the text beside them. */

import { button, type Attributes } from './dom.ts';

const PATHS = {
  play: 'M4 2.5v11l9-5.5z',
  pause: 'M4 2.5h3v11H4zM9 2.5h3v11H9z',
  stepBack: 'M4 2.5h2v11H4zM13 2.5v11L7 8z',
  stepForward: 'M10 2.5h2v11h-2zM3 2.5v11L9 8z',
  start: 'M3 2.5h2v11H3zM9.5 2.5v11L5.5 8zM14 2.5v11L10 8z',
  close: 'M3.5 2.4 8 6.9l4.5-4.5 1.1 1.1L9.1 8l4.5 4.5-1.1 1.1L8 9.1l-4.5 4.5-1.1-1.1L6.9 8 2.4 3.5z',
  add: 'M7 2.5h2V7h4.5v2H9v4.5H7V9H2.5V7H7z',
  help: 'M5 5.6C5 3.7 6.3 2.5 8.1 2.5S11.2 3.7 11.2 5.3c0 2.3-2.4 2.4-2.4 4.4H7.2c0-2.6 2.3-2.9 2.3-4.3 0-.8-.6-1.3-1.4-1.3-.9 0-1.4.5-1.5 1.5zM7.1 11.2h1.9v2H7.1z',
  layout: 'M2 2.5h12v11H2zM3.5 4v8H7V4zm5 0v3h4V4zm0 4.5V12h4V8.5z',
  table: 'M2 3h12v10H2zm1.5 3v2h4V6zm5.5 0v2h3.5V6zM3.5 9.5v2h4v-2zm5.5 0v2h3.5v-2z',
  picture: 'M2 3h12v10H2zm1.5 8.5h9L9.7 7l-2 2.6-1.5-1.4zM5 4.7a1.2 1.2 0 1 0 .1 0z',
  theme: 'M8 1.5a6.5 6.5 0 1 0 0 13zm0 1.6v9.8',
} as const;

type IconName = keyof typeof PATHS;

/** A button with an icon alone; `title` says what it does. */
export function iconButton(
  name: IconName,
  title: string,
  action: () => void,
  attributes: Attributes,
): HTMLButtonElement {
  return button(icon(name), action, { title, 'aria-label': title, ...attributes });
}

export function icon(name: IconName): SVGSVGElement {
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  svg.setAttribute('viewBox', '0 0 16 16');
  svg.setAttribute('class', 'icon');
  svg.setAttribute('aria-hidden', 'true');
  const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
  path.setAttribute('d', PATHS[name]);
  svg.append(path);
  return svg;
}
