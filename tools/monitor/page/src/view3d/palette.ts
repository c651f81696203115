/** Colours of modules and roles, equal in all parts of the page. */

/** Distinct on light and on dark ground, and for most kinds of colour blindness. */
const PALETTE = [
  '#4c78a8',
  '#f58518',
  '#54a24b',
  '#e45756',
  '#72b7b2',
  '#b279a2',
  '#d9b01e',
  '#9d755d',
  '#ff9da6',
  '#7f7f7f',
  '#2f4b7c',
  '#a05195',
];

/** The colour of a module or link that has no role. */
export const NO_ROLE = '#8a919c';

/** Lines in plots; the first are those of run A and run B. */
export const LINE_COLOURS = ['#3b82c4', '#e07b1a', '#3f9c4a', '#d1495b', '#8a63b8', '#1f9e9e', '#b58900', '#d16ba5'];

/** Gives names colours in the order in which they come, the same name always the same colour. */
export class ColourMap {
  private readonly indices = new Map<string, number>();

  of(name: string): string {
    if (!name) return NO_ROLE;
    let index = this.indices.get(name);
    if (index === undefined) {
      index = this.indices.size;
      this.indices.set(name, index);
    }
    return PALETTE[index % PALETTE.length];
  }
}
