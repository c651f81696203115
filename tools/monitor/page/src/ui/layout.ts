/** What the page shows, as a value: for its URL, and for layouts that are kept under a name. */

import type { ViewOptions } from '../view3d/view.ts';
import { recall, remember } from './settings.ts';

/** A layout; what is missing stays as it is. */
export interface Layout {
  /** Sim time in seconds; missing while the newest instant is followed. */
  time?: number;
  /** The letter of the run, and the module. */
  selected?: { letter: string; module: string };
  tab?: string;
  /** Length of the plots, seconds; 0: all. */
  window?: number;
  /** Ids of the fields of each plot. */
  plots?: string[][];
  /** Flags of the view that are on. */
  flags?: string[];
  colourBy?: ViewOptions['colourBy'];
  layout?: ViewOptions['layout'];
  /** Where the camera is and looks to, relative to the robots, metres. */
  camera?: number[];
}

const SAVED = 'layouts';

/** A coordinate in millimetres' steps. What rounds to zero has no sign, which would be another with every frame. */
function placeText(metres: number): string {
  return (Math.round(metres * 1000) / 1000).toFixed(3);
}

/** A layout as the part of a URL behind "#". */
export function hashOf(layout: Layout): string {
  const parameters = new URLSearchParams();
  if (layout.time !== undefined) parameters.set('t', layout.time.toFixed(2));
  if (layout.selected) parameters.set('module', `${layout.selected.letter}.${layout.selected.module}`);
  if (layout.tab) parameters.set('tab', layout.tab);
  if (layout.window !== undefined) parameters.set('window', String(layout.window));
  if (layout.flags) parameters.set('show', layout.flags.join(' '));
  if (layout.colourBy) parameters.set('colour', layout.colourBy);
  if (layout.layout) parameters.set('robots', layout.layout);
  if (layout.camera) parameters.set('camera', layout.camera.map(placeText).join(' '));
  for (const fields of layout.plots ?? []) parameters.append('plot', fields.join(';'));
  return parameters.toString();
}

/** The layout in a URL's hash; what it does not say, or not soundly, is missing. */
export function layoutIn(hash: string): Layout {
  const parameters = new URLSearchParams(hash.replace(/^#/, ''));
  const layout: Layout = {};
  const number = (name: string): number | undefined => {
    const value = Number(parameters.get(name) ?? NaN);
    return Number.isFinite(value) ? value : undefined;
  };
  layout.time = number('t');
  layout.window = number('window');
  const [letter, module] = (parameters.get('module') ?? '').split('.');
  if (module) layout.selected = { letter, module };
  layout.tab = parameters.get('tab') ?? undefined;
  layout.flags = parameters.get('show')?.split(' ').filter(Boolean);
  const colour = parameters.get('colour');
  if (colour === 'role' || colour === 'module') layout.colourBy = colour;
  const robots = parameters.get('robots');
  if (robots === 'beside' || robots === 'over') layout.layout = robots;
  const camera = parameters.get('camera')?.split(' ').map(Number);
  if (camera?.length === 6 && camera.every(Number.isFinite)) layout.camera = camera;
  const plots = parameters.getAll('plot').map((fields) => fields.split(';').filter(Boolean));
  if (plots.length) layout.plots = plots.filter((fields) => fields.length);
  return layout;
}

/** Layouts that were saved here, by name. */
export function savedLayouts(): Record<string, Layout> {
  return recall<Record<string, Layout>>(SAVED, {});
}

/** Saves one, or forgets it (null). */
export function saveLayout(name: string, layout: Layout | null): void {
  const layouts = savedLayouts();
  if (layout) layouts[name] = layout;
  else delete layouts[name];
  remember(SAVED, layouts);
}
