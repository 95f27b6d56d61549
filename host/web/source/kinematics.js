// Bus and arm from the system's centre of mass, attitude and joint angles; what the end effector misses by.

import { about, add, dot, norm, product, scale, sub, turned, turnedBack, unit } from "./vectors.js";

/** Pivots of the joints and the end effector, from the bus's centre of mass; each link's attitude; the system's
 * centre of mass: all in bus axes. */
export function posture(mission, angles) {
  let at = mission.arm_base_bus_m;
  let attitude = [0, 0, 0, 1];
  let mass = mission.bus_mass_kg;
  let moment = [0, 0, 0];
  const points = [at];
  const attitudes = [];
  mission.links.forEach((link, i) => {
    attitude = product(attitude, about(link.axis_link, angles[i]));
    moment = add(moment, scale(add(at, turned(attitude, link.com_from_joint_link_m)), link.mass_kg));
    mass += link.mass_kg;
    at = add(at, turned(attitude, link.tip_from_joint_link_m));
    points.push(at);
    attitudes.push(attitude);
  });
  return { points, attitudes, center: scale(moment, 1 / mass), mass };
}

/** Where the bus's centre of mass is [m], RTN. */
export function busPosition(mission, { position, attitude, jointAngle }) {
  return sub(position, turned(attitude, posture(mission, jointAngle).center));
}

/** Where the end effector is [m], RTN. */
export function endEffector(mission, { position, attitude, jointAngle }) {
  const { points, center } = posture(mission, jointAngle);
  return add(position, turned(attitude, sub(points[points.length - 1], center)));
}

/** Where the port is [m], RTN. */
export const port = (mission, targetAttitude) => turned(targetAttitude, mission.port_position_target_m);

/** The end effector from the port [m]. */
export const miss = (mission, state, targetAttitude) =>
  norm(sub(endEffector(mission, state), port(mission, targetAttitude)));

/** Between the boresight and the way from the centre of mass to the port [rad]. */
export function offBoresight(mission, { position, attitude }, targetAttitude) {
  const sight = unit(sub(port(mission, targetAttitude), position));
  return Math.acos(Math.min(1, Math.max(-1, dot(sight, turned(attitude, mission.boresight_bus)))));
}

/** From a point in RTN to the surface of the target's box [m]; negative inside. */
export function distanceToBox(mission, point, targetAttitude) {
  const local = turnedBack(targetAttitude, point);
  const beyond = mission.target_half_extents_body_m.map((half, i) => Math.abs(local[i]) - half);
  const outside = norm(beyond.map((d) => Math.max(d, 0)));
  return outside > 0 ? outside : Math.max(...beyond);
}
