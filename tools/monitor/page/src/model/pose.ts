/** Poses of frames: positions in metres, unit quaternions in the order w x y z. */

export type Vector = [number, number, number];
export type Quaternion = [number, number, number, number];

/** Pose X_AB of a frame B in a frame A: p_AoBo_A and q_AB. */
export interface Pose {
  p: Vector;
  q: Quaternion;
}

export const IDENTITY: Pose = { p: [0, 0, 0], q: [1, 0, 0, 0] };

/** The vector v, given in B, expressed in A. */
export function rotate(q: Quaternion, v: Vector): Vector {
  const [w, x, y, z] = q;
  const [a, b, c] = v;
  // t = 2 u x v with u the vector part; the result is v + w t + u x t.
  const tx = 2 * (y * c - z * b);
  const ty = 2 * (z * a - x * c);
  const tz = 2 * (x * b - y * a);
  return [a + w * tx + (y * tz - z * ty), b + w * ty + (z * tx - x * tz), c + w * tz + (x * ty - y * tx)];
}

export function multiplyRotations(a: Quaternion, b: Quaternion): Quaternion {
  return [
    a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
    a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
    a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
    a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
  ];
}

export function conjugate(q: Quaternion): Quaternion {
  return [q[0], -q[1], -q[2], -q[3]];
}

/** X_AC = X_AB * X_BC. */
export function compose(X_AB: Pose, X_BC: Pose): Pose {
  return { p: transform(X_AB, X_BC.p), q: multiplyRotations(X_AB.q, X_BC.q) };
}

/** The point p, given in B, in A. */
export function transform(X_AB: Pose, p: Vector): Vector {
  const r = rotate(X_AB.q, p);
  return [r[0] + X_AB.p[0], r[1] + X_AB.p[1], r[2] + X_AB.p[2]];
}

export function invert(X_AB: Pose): Pose {
  const q = conjugate(X_AB.q);
  const p = rotate(q, X_AB.p);
  return { p: [-p[0], -p[1], -p[2]], q };
}

export function distance(a: Vector, b: Vector): number {
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/** The angle of the rotation from one orientation to another, radians, 0 to pi. */
export function angleBetween(a: Quaternion, b: Quaternion): number {
  const d = multiplyRotations(conjugate(a), b);
  return 2 * Math.atan2(Math.hypot(d[1], d[2], d[3]), Math.abs(d[0]));
}

/** Rotations about the fixed axes x, y and z, in this order, radians; the middle one lies within a quarter turn. */
export function fixedAngles(q: Quaternion): Vector {
  const [w, x, y, z] = q;
  const sine = Math.max(-1, Math.min(1, 2 * (w * y - z * x)));
  return [
    Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
    Math.asin(sine),
    Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
  ];
}
