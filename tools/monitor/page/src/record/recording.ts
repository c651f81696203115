/** A recording that goes on: which pictures it takes, and when. */

import type { ViewClock } from '../model/view_clock.ts';
import type { Session } from '../model/session.ts';
import type { Film } from './film.ts';

/** What is recorded. */
export interface RecordingPlan {
  /** The plots, too. */
  plots: boolean;
  /** Of logs: the stretch of sim time, seconds; null for what a run does from now on. */
  stretch: { from: number; to: number } | null;
}

/** Pictures a second. */
export const RATE = 30;
/** A video that grows beyond this is ended: browsers keep it in memory until it is saved. */
export const MOST_BYTES = 500_000_000;

export class Recording {
  /** How much has been taken, seconds of the video. */
  length = 0;
  private count = 0;
  private began = NaN;
  private waiting = false;
  private over = false;
  /** Whether the time that is shown is moved on picture by picture, however long each takes. */
  private readonly steps: boolean;

  /**
   * @param draw draws the picture that the film takes, of what the page shows.
   * @param onEnd is told when nothing more will be taken: null, or why it failed.
   */
  constructor(
    private readonly film: Film,
    private readonly plan: RecordingPlan,
    private readonly session: Session,
    private readonly clock: ViewClock,
    private readonly draw: () => void,
    private readonly onEnd: (failure: Error | null) => void,
  ) {
    this.steps = plan.stretch !== null && film.timed;
    if (!plan.stretch) return;
    clock.seek(plan.stretch.from);
    // Without times of its own the film takes as long as it lasts.
    if (!this.steps) clock.play();
  }

  /** Sim time of the picture that comes next, seconds. */
  private get next(): number {
    return (this.plan.stretch?.from ?? 0) + (this.count * this.clock.speed) / RATE;
  }

  /** Before a frame of the page: sees to it that this shows what is to be taken. */
  lead(): void {
    if (this.steps && !this.over) this.clock.seek(this.next);
  }

  /**
   * After a frame of the page has been drawn: takes it, if it is to be.
   * @param now a clock of the wall, seconds.
   */
  take(now: number): void {
    if (this.waiting || this.over) return;
    // A part of a log that is not there yet is waited for.
    if (this.steps && !this.session.has(this.next)) return;
    if (Number.isNaN(this.began)) this.began = now;
    const time = this.steps ? this.count / RATE : now - this.began;
    if (time < this.length - 0.5 / RATE) return;
    this.draw();
    this.count++;
    this.length = time + 1 / RATE;
    this.waiting = true;
    this.film.add(time, 1 / RATE).then(
      () => (this.waiting = false),
      (failure: Error) => this.end(failure),
    );
    if (this.isLast()) this.end(null);
  }

  /** Takes nothing more. */
  end(failure: Error | null): void {
    if (this.over) return;
    this.over = true;
    this.onEnd(failure);
  }

  private isLast(): boolean {
    if (this.film.bytes > MOST_BYTES) return true;
    const { stretch } = this.plan;
    if (this.steps && stretch) return this.next > stretch.to + 1e-6;
    // Beyond its end a run shows nothing new.
    const { ended, end } = this.session.range();
    const last = Math.min(end, stretch?.to ?? Infinity);
    return (ended || stretch !== null) && this.clock.time >= last - 1e-6;
  }
}
