/** What all panels of the page share. */

import type { Run } from '../model/run.ts';
import type { SourcePlace } from '../model/run_data.ts';
import type { Session } from '../model/session.ts';
import type { ViewClock } from '../model/view_clock.ts';
import { element } from './dom.ts';

export interface Selection {
  run: Run;
  module: string;
}

export interface Context {
  readonly session: Session;
  readonly clock: ViewClock;
  /** The instant that is shown, seconds of sim time; NaN while there is nothing to show. */
  time: number;
  /** The module that the user has picked. */
  selected: Selection | null;
  degrees: boolean;
  select(selection: Selection | null): void;
  /** Shows an instant, and stays there. */
  seek(time: number): void;
  /** Opens the program at a line, if its text is known. */
  showSource(run: Run, place: SourcePlace): void;
  /** The colour of a module at the instant that is shown, "#rrggbb": that of its role, or its own where the view has those. */
  colourOf(run: Run, module: string): string;
  /** The same for a line over time: by the last role that is known. */
  lineColourOf(run: Run, module: string): string;
  /** The colour of a role, "#rrggbb"; null for a name that is no role of the programs. */
  colourOfRole(role: string): string | null;
  /** Tells what happened in a line of the bar that goes away by itself; one at a time. */
  tell(text: string, kind?: 'info' | 'error'): void;
}

/** A part of the page that shows something of the state. */
export interface Panel {
  readonly element: HTMLElement;
  /** Takes up what has changed. Called a few times a second while the panel is visible. */
  update(): void;
}

/** How a run is called on the page: with its letter where there are two. */
export function runTitle(context: Context, run: Run): string {
  return context.session.runs.length > 1 ? `${run.letter} · ${run.name}` : run.name;
}

/** The heading of what is told of one run: none where there is one alone. */
export function runHeading(context: Context, run: Run): HTMLElement[] {
  return context.session.runs.length > 1 ? [element('h3', {}, runTitle(context, run))] : [];
}

/** The factor and the unit by which a quantity is shown: angles in degrees if the user wants them so. */
export function displayUnit(unit: string, degrees: boolean): { unit: string; scale: number } {
  if (degrees && unit === 'rad') return { unit: '°', scale: 180 / Math.PI };
  if (degrees && unit === 'rad/s') return { unit: '°/s', scale: 180 / Math.PI };
  return { unit, scale: 1 };
}
