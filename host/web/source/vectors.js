// Vectors as arrays, quaternions as [x, y, z, w], body to RTN. Written for this page alone: what it computes
// confirms the planner's numbers by other code.

export const add = (a, b) => a.map((x, i) => x + b[i]);
export const sub = (a, b) => a.map((x, i) => x - b[i]);
export const scale = (a, s) => a.map((x) => x * s);
export const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
export const norm = (a) => Math.sqrt(dot(a, a));
export const unit = (a) => scale(a, 1 / norm(a));
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const mix = (a, b, share) => a.map((x, i) => x + (b[i] - x) * share);

/** The quaternion of a turn by `b`, then by `a`. */
export const product = ([ax, ay, az, aw], [bx, by, bz, bw]) => [
  aw * bx + ax * bw + ay * bz - az * by,
  aw * by - ax * bz + ay * bw + az * bx,
  aw * bz + ax * by - ay * bx + az * bw,
  aw * bw - ax * bx - ay * by - az * bz,
];

export const conjugate = ([x, y, z, w]) => [-x, -y, -z, w];

/** A vector turned by a unit quaternion. */
export function turned([x, y, z, w], v) {
  const t = scale(cross([x, y, z], v), 2);
  return add(add(v, scale(t, w)), cross([x, y, z], t));
}

/** A vector turned back. */
export const turnedBack = (q, v) => turned(conjugate(q), v);

/** The quaternion of a turn about a unit axis by an angle [rad]. */
export function about(axis, angle) {
  const sine = Math.sin(angle / 2);
  return [axis[0] * sine, axis[1] * sine, axis[2] * sine, Math.cos(angle / 2)];
}

/** The quaternion of a rotation vector [rad]. */
export function exponential(theta) {
  const angle = norm(theta);
  return angle < 1e-12 ? [theta[0] / 2, theta[1] / 2, theta[2] / 2, 1] : about(scale(theta, 1 / angle), angle);
}

/** Between two attitudes, on the shorter way round. */
export function slerp(a, b, share) {
  const near = dot(a, b) < 0 ? scale(b, -1) : b;
  const cosine = Math.min(1, dot(a, near));
  if (cosine > 1 - 1e-12) {
    return unit(mix(a, near, share));
  }
  const angle = Math.acos(cosine);
  const [from, to] = [Math.sin((1 - share) * angle), Math.sin(share * angle)];
  return unit(a.map((x, i) => (x * from + near[i] * to) / Math.sin(angle)));
}
