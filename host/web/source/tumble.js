// The target's motion from its start: a rigid body on a circular orbit, turned by the gravity gradient where that is
// in force (docs/concepts/problem.md, section 2).

import { add, cross, scale, sub, turnedBack, unit } from "./vectors.js";

/** Largest turn in a step of integration [rad]: over a hundred radians the fourth-order error stays below 1e-9 rad. */
const TURN = 5e-3;

/** The target's attitude at each of `nodes` times, `step` seconds apart, from the first on. */
export function tumble(mission, meanMotion, hasGradient, scenario, step, nodes) {
  let state = { q: unit(scenario.target_attitude_body_to_rtn), w: null };
  const frame = (q) => turnedBack(q, [0, 0, meanMotion]);
  // The rate relative to inertial space, in body axes.
  state.w = add(scenario.target_rate_body_rad_s, frame(state.q));
  const speed = Math.hypot(...state.w) + 2 * meanMotion;
  const steps = Math.ceil((speed * step) / TURN);
  const slope = slopes(mission.target_inertia_body_kg_m2, meanMotion, hasGradient);
  const attitudes = [];
  for (let node = 0; node < nodes; node++) {
    attitudes.push(state.q);
    for (let i = 0; i < steps; i++) {
      state = runge(slope, state, step / steps);
    }
  }
  return attitudes;
}

/** Slopes of attitude and inertial body rate. */
function slopes(inertia, n, hasGradient) {
  return ({ q, w }) => {
    // Between the steps it is not quite of unit length.
    const attitude = unit(q);
    const radial = turnedBack(attitude, [1, 0, 0]);
    const momentum = w.map((x, i) => inertia[i] * x);
    const arm = radial.map((x, i) => inertia[i] * x);
    const gradient = scale(cross(radial, arm), hasGradient ? 3 * n * n : 0);
    const torque = sub(gradient, cross(w, momentum));
    // q' = 1/2 (relative rate in RTN, 0) * q = 1/2 q * (relative rate in body axes, 0)
    const relative = sub(w, turnedBack(attitude, [0, 0, n]));
    const [x, y, z, s] = q;
    const [a, b, c] = relative;
    return {
      q: scale([s * a + y * c - z * b, s * b - x * c + z * a, s * c + x * b - y * a, -x * a - y * b - z * c], 0.5),
      w: torque.map((t, i) => t / inertia[i]),
    };
  };
}

/** A step of the classical Runge-Kutta method. */
function runge(slope, state, h) {
  const from = (k, share) => ({ q: add(state.q, scale(k.q, share * h)), w: add(state.w, scale(k.w, share * h)) });
  const k1 = slope(state);
  const k2 = slope(from(k1, 0.5));
  const k3 = slope(from(k2, 0.5));
  const k4 = slope(from(k3, 1));
  const mean = (part) => {
    const sum = (i) => k1[part][i] + 2 * (k2[part][i] + k3[part][i]) + k4[part][i];
    return state[part].map((x, i) => x + (h / 6) * sum(i));
  };
  return { q: unit(mean("q")), w: mean("w") };
}
