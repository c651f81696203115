/** Which instant of sim time the page shows: the newest one, one that is held, or one that moves through the past. */

export type ClockMode = 'follow' | 'hold' | 'play';

/** The speeds that the time line offers, times real time. */
export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];

/** By how much playing moves on at once, seconds of the wall: a page that was hidden or kept waiting does not jump. */
const LONGEST_STEP = 0.25;

/** Times are seconds of sim time; `now` is any clock of the wall in seconds that does not go back. */
export class ViewClock {
  mode: ClockMode = 'follow';
  speed = 1;
  private held = 0;
  private lastNow = NaN;

  /**
   * Goes on by the time that has passed since the last call.
   * @param begin, end the oldest and the newest instant that there is to show; NaN without any.
   * @param ended true if nothing newer will come: playing then stops at the end, else it goes over into following.
   * @returns the instant to show; NaN without any.
   */
  advance(now: number, begin: number, end: number, ended: boolean): number {
    const passed = Number.isNaN(this.lastNow) ? 0 : Math.min(LONGEST_STEP, Math.max(0, now - this.lastNow));
    this.lastNow = now;
    if (Number.isNaN(end)) return NaN;
    if (this.mode === 'follow') {
      this.held = end;
      return end;
    }
    if (this.mode === 'play') {
      this.held += passed * this.speed;
      if (this.held >= end) {
        this.held = end;
        // What is still coming is waited for; a recording that is over is shown at its end.
        this.mode = ended ? 'hold' : 'follow';
      }
    }
    this.held = Math.min(Math.max(this.held, begin), end);
    return this.held;
  }

  /** Shows one instant, and stays there. */
  seek(time: number): void {
    this.held = time;
    this.mode = 'hold';
  }

  pause(): void {
    this.mode = 'hold';
  }

  /** Plays on from the instant that is shown. */
  play(): void {
    this.mode = 'play';
  }

  follow(): void {
    this.mode = 'follow';
  }

  /** The next higher (+1) or lower (-1) of SPEEDS. */
  changeSpeed(direction: 1 | -1): void {
    const nearest = SPEEDS.reduce(
      (best, s, i) => (Math.abs(s - this.speed) < Math.abs(SPEEDS[best] - this.speed) ? i : best),
      0,
    );
    this.speed = SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, nearest + direction))];
  }

  get time(): number {
    return this.held;
  }
}
