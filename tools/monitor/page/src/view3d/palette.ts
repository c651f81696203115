/**
 * Colours that the page chooses itself. Those of modules and roles come from the server, which has one mapping for all
 * pictures (compiler/base/role_colors.h).
 */

/** The colour of a module or link of which nothing is known. */
export const UNKNOWN = '#8a919c';

/** x, y, z of frames, and so north, up, east of the world. */
export const AXIS_COLOURS = ['#e03131', '#2f9e44', '#1c7ed6'];

/** Forces by the table that has them. */
export const FORCE_COLOURS = { contacts: '#12a594', pushes: '#e0308a' };

/** Around the selected module. */
export const SELECTED = '#1f7ae0';

/** Where modules believe their links to be. */
export const PROPAGATED = '#e8930c';

/** Lines in plots that are of no module. */
export const LINE_COLOURS = ['#3b82c4', '#e07b1a', '#3f9c4a', '#d1495b', '#8a63b8', '#1f9e9e', '#b58900', '#d16ba5'];

/** How far the second, third … line of one colour in a plot is moved towards black (below 0) or white. */
const STEPS = [0, -0.35, 0.4, -0.6, 0.65];

/** The colour ("#rrggbb") as the line number `repeat` of that colour in a plot has it: a little darker or lighter. */
export function shade(colour: string, repeat: number): string {
  const step = STEPS[repeat % STEPS.length];
  const parts = [1, 3, 5].map((i) => {
    const c = parseInt(colour.slice(i, i + 2), 16);
    const moved = step < 0 ? c * (1 + step) : c + (255 - c) * step;
    return Math.round(moved).toString(16).padStart(2, '0');
  });
  return `#${parts.join('')}`;
}
