/** Poses between two ticks, for slow motion. */

import type { Pose, Quaternion } from '../model/pose.ts';
import type { Run } from '../model/run.ts';

/** Ticks further apart than this, seconds, are not joined: something is missing between them. */
const LONGEST_GAP = 0.25;

/**
 * The pose of a link at `time`, of which `row` is the last row at or before it: between it and the next one, as far as
 * that is known and near. Null if the link has no pose then.
 */
export function fixedPoseAt(run: Run, link: number, row: number, time: number): Pose | null {
  const before = run.pose(link, row);
  if (!before || row + 1 >= run.poses.length) return before;
  const t0 = run.poses.time(row);
  const t1 = run.poses.time(row + 1);
  const share = (time - t0) / (t1 - t0);
  if (!(share > 1e-6) || t1 - t0 > LONGEST_GAP) return before;
  const after = run.pose(link, row + 1);
  return after ? between(before, after, Math.min(1, share)) : before;
}

/** Linear in position, and in the quaternion's components, normalized: enough for the small turns of a tick. */
function between(a: Pose, b: Pose, share: number): Pose {
  const dot = a.q[0] * b.q[0] + a.q[1] * b.q[1] + a.q[2] * b.q[2] + a.q[3] * b.q[3];
  const sign = dot < 0 ? -1 : 1;
  const q = a.q.map((value, i) => value * (1 - share) + sign * b.q[i] * share) as Quaternion;
  const length = Math.hypot(...q) || 1;
  return {
    p: [a.p[0] + (b.p[0] - a.p[0]) * share, a.p[1] + (b.p[1] - a.p[1]) * share, a.p[2] + (b.p[2] - a.p[2]) * share],
    q: q.map((value) => value / length) as Quaternion,
  };
}
