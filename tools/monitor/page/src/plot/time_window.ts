/** Which stretch of sim time all plots show: so many seconds with the cursor in it, or what the user has zoomed to. */

/** Shortest stretch, seconds: a few ticks. */
const SHORTEST = 0.05;
/** So far from the edge, in parts of the window, the cursor stays while time moves on. */
const MARGIN = 0.06;

export class TimeWindow {
  private from = 0;
  private to: number;
  private lastTime = NaN;
  /** Whether it is another one than the user's seconds give. */
  zoomed = false;

  /** @param seconds length; 0: all that is there. */
  constructor(private seconds: number) {
    this.to = seconds || 1;
  }

  /** The user's seconds. */
  get length(): number {
    return this.seconds;
  }

  /** The stretch for the instant that is shown, of what there is. Whenever that instant moves, the window takes it in. */
  at(time: number, begin: number, end: number): [number, number] {
    const moved = time !== this.lastTime;
    this.lastTime = time;
    if (!this.zoomed && !this.seconds) {
      [this.from, this.to] = [begin, Math.max(begin + 1, end)];
      return [this.from, this.to];
    }
    const length = this.to - this.from;
    const room = length * MARGIN;
    if (!moved) return [this.from, this.to];
    if (time > this.to - room && this.to < end + room) this.move(time + room - this.to);
    if (time > this.to) this.move(time + room - this.to);
    if (time < this.from) this.move(Math.max(begin, time - room) - this.from);
    return [this.from, this.to];
  }

  /** So many seconds from now on, 0 for all; the cursor keeps to the right edge. */
  setSeconds(seconds: number, time: number): void {
    this.seconds = seconds;
    this.reset(time);
  }

  /** Back to the user's seconds. */
  reset(time: number): void {
    this.zoomed = false;
    const length = this.seconds || 1;
    const from = Math.max(0, time - length * (1 - MARGIN));
    [this.from, this.to] = [from, from + length];
  }

  /** Shows this stretch. */
  show(from: number, to: number): void {
    this.zoomed = true;
    const length = Math.max(SHORTEST, to - from);
    [this.from, this.to] = [from, from + length];
  }

  /** Longer or shorter by a factor; `about` stays where it is. */
  zoom(factor: number, about: number): void {
    const length = Math.max(SHORTEST, (this.to - this.from) * factor);
    const share = (about - this.from) / (this.to - this.from);
    this.show(about - share * length, about + (1 - share) * length);
  }

  /** Moves it by so many seconds. */
  pan(seconds: number): void {
    this.show(this.from + seconds, this.to + seconds);
  }

  private move(seconds: number): void {
    this.from += seconds;
    this.to += seconds;
  }
}
