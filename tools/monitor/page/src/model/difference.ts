/** By how much the labelled links of two runs lie apart, as time goes on. */

import {
  angleBetween,
  conjugate,
  distance,
  invert,
  multiplyRotations,
  transform,
  type Pose,
  type Vector,
} from './pose.ts';
import type { Pair } from './pairs.ts';
import type { Run } from './run.ts';
import type { NamedTable } from './run_data.ts';
import { Table } from './table.ts';

/** A pair of links with what it looked like at the reference time. */
interface Matched extends LinkPair {
  /** Their indices in the runs. */
  a: number;
  b: number;
  X_WA0: Pose;
  X_WB0: Pose;
  /** The point of link B that lay at the origin of link A then, in B. */
  p_B: Vector;
}

/** Two links that answer to each other, "module/link". */
interface LinkPair {
  name: string;
  linkA: string;
  linkB: string;
}

/** The links with labels that a run has now: by "Role.label" all that bear it. */
export function labelledLinks(run: Run): Map<string, string[]> {
  const links = new Map<string, string[]>();
  for (const module of run.moduleNames) {
    const state = run.lastState(module);
    if (!state?.role) continue;
    for (const label of state.labels) {
      if (label.kind !== 'link') continue;
      const name = `${state.role}.${label.name}`;
      links.set(name, [...(links.get(name) ?? []), `${module}/${label.target}`]);
    }
  }
  return links;
}

/**
 * The table of differences of two runs, which grows with them.
 *
 * Two congruent robots may have their link frames at different places of the same piece of metal. So positions are those
 * of the point of either link that lay at the origin of A's link frame at the reference time, and rotations are those
 * since then, as `morphbus compare` does it for the pose at rest.
 */
export class Difference implements NamedTable {
  readonly table = new Table(30000);
  private linkPairs: LinkPair[] = [];
  private pairs: Matched[] = [];
  private key = '';
  private nextTime = -Infinity;
  /** The instant from which on the runs are compared, seconds; NaN while nothing can be compared. */
  reference = NaN;

  constructor(
    readonly a: Run,
    readonly b: Run,
  ) {}

  /** Takes up who answers to whom; links with labels are compared. */
  setPairs(pairs: readonly Pair[]): void {
    this.linkPairs = pairs
      .filter((pair) => pair.kind === 'link' && pair.labelled)
      .map(({ name, moduleA, partA, moduleB, partB }) => ({
        name,
        linkA: `${moduleA}/${partA}`,
        linkB: `${moduleB}/${partB}`,
      }));
    this.key = '';
  }

  /** The point of B's link that lay at the origin of A's at the reference time, in B; null before it is known. */
  pointInB(linkA: string): Vector | null {
    return this.pairs.find((pair) => pair.linkA === linkA)?.p_B ?? null;
  }

  unit(column: string): string {
    return column.endsWith('rotation') ? 'rad' : 'm';
  }

  get pairNames(): string[] {
    return this.pairs.map((pair) => pair.name);
  }

  /** Takes up what both runs have got since the last call. */
  update(): void {
    const begin = Math.max(this.a.poses.beginTime, this.b.poses.beginTime);
    if (Number.isNaN(begin)) return;
    this.match(begin);
    const end = Math.min(this.a.poses.endTime, this.b.poses.endTime);
    // A log that was wound back is compared anew from there on.
    if (end < this.table.endTime && this.nextTime > end) this.nextTime = end;
    if (!this.pairs.length) return;
    for (let row = this.a.poses.lowerBound(Math.max(begin, this.nextTime)); row < this.a.poses.length; row++) {
      const time = this.a.poses.time(row);
      if (time > end) break;
      this.nextTime = time + 1e-9;
      this.compareAt(time, row);
    }
  }

  /** Position (m) and rotation (rad) by which a pair lies apart at a time; null if unknown. */
  at(pair: string, time: number): { position: number; rotation: number } | null {
    const row = this.table.rowAt(time);
    const column = this.table.find(`${pair} position`);
    if (row < 0 || column < 0) return null;
    return { position: this.table.value(column, row), rotation: this.table.value(column + 1, row) };
  }

  /** The largest value of a column so far; 0 without any. */
  maximum(column: string): number {
    const index = this.table.find(column);
    let most = 0;
    for (let row = 0; index >= 0 && row < this.table.length; row++) {
      const value = this.table.value(index, row);
      if (value > most) most = value;
    }
    return most;
  }

  private match(begin: number): void {
    const key = `${this.a.structureVersion} ${this.b.structureVersion}`;
    if (key === this.key && this.reference <= this.a.poses.endTime) return;
    this.key = key;
    const reference = Number.isNaN(this.reference) || begin < this.reference ? begin : this.reference;
    // The poses at the reference time are kept from when it was still in the tables.
    const known = new Map(this.pairs.map((pair) => [`${pair.name} ${pair.linkA} ${pair.linkB}`, pair]));
    const rowA = Math.max(0, this.a.poses.rowAt(Math.max(reference, begin)));
    const rowB = Math.max(0, this.b.poses.rowAt(Math.max(reference, begin)));
    const pairs: Matched[] = [];
    for (const pair of this.linkPairs) {
      const old = reference === this.reference ? known.get(`${pair.name} ${pair.linkA} ${pair.linkB}`) : undefined;
      if (old) {
        pairs.push(old);
        continue;
      }
      const a = this.a.linkIndex(pair.linkA);
      const b = this.b.linkIndex(pair.linkB);
      const X_WA0 = this.a.pose(a, rowA);
      const X_WB0 = this.b.pose(b, rowB);
      if (X_WA0 && X_WB0) pairs.push({ ...pair, a, b, X_WA0, X_WB0, p_B: transform(invert(X_WB0), X_WA0.p) });
    }
    const changed =
      pairs.map((p) => p.name + p.linkA + p.linkB).join() !== this.pairs.map((p) => p.name + p.linkA + p.linkB).join();
    if (changed || reference !== this.reference) {
      this.table.clear();
      this.nextTime = -Infinity;
    }
    this.pairs = pairs;
    this.reference = reference;
  }

  private compareAt(time: number, rowA: number): void {
    const rowB = this.b.poses.rowAt(time + 1e-9);
    // An instant that only one of them has is not compared.
    if (rowB < 0 || Math.abs(this.b.poses.time(rowB) - time) > 1e-6) return;
    this.table.row(time);
    for (const pair of this.pairs) {
      const X_WA = this.a.pose(pair.a, rowA);
      const X_WB = this.b.pose(pair.b, rowB);
      if (!X_WA || !X_WB) continue;
      const position = this.table.column(`${pair.name} position`);
      const rotation = this.table.column(`${pair.name} rotation`);
      this.table.set(position, distance(X_WA.p, transform(X_WB, pair.p_B)));
      const turnA = multiplyRotations(X_WA.q, conjugate(pair.X_WA0.q));
      const turnB = multiplyRotations(X_WB.q, conjugate(pair.X_WB0.q));
      this.table.set(rotation, angleBetween(turnA, turnB));
    }
  }
}
