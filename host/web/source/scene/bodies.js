// Target and servicer as bodies, with the sizes that the mission gives them.

import * as three from "three";
import { posture } from "../kinematics.js";
import { add, norm, sub, turned } from "../vectors.js";

const UP = new three.Vector3(0, 1, 0);
const FORWARD = new three.Vector3(0, 0, 1);

/** Turns and moves an object; arrays as the rest of the page has them. */
export function place(object, position, attitude) {
  object.position.set(...position);
  object.quaternion.set(...attitude);
}

/** Materials of solid bodies, or of a ghost: what is planned beside what is flown. */
function materials(colours, isGhost) {
  const solid = (name) =>
    colours.of(
      isGhost ? "ghost" : name,
      new three.MeshLambertMaterial(isGhost ? { transparent: true, opacity: 0.16, depthWrite: false } : {}),
    );
  const edge = colours.of(
    isGhost ? "ghost" : "edge",
    new three.LineBasicMaterial({ transparent: true, opacity: isGhost ? 0.55 : 0.45 }),
  );
  return { solid, edge };
}

function box(half, material, edge) {
  const geometry = new three.BoxGeometry(...half.map((x) => 2 * x));
  const mesh = new three.Mesh(geometry, material);
  mesh.add(new three.LineSegments(new three.EdgesGeometry(geometry), edge));
  return mesh;
}

/** A body along `way`, `length` of it. */
function along(geometry, material, way, length) {
  const mesh = new three.Mesh(geometry, material);
  const direction = new three.Vector3(...way).normalize();
  mesh.quaternion.setFromUnitVectors(UP, direction);
  mesh.position.copy(direction).multiplyScalar(length / 2);
  return mesh;
}

/** The target's box with its port: a ring, and its normal. */
export function makeTarget(mission, colours) {
  const { solid, edge } = materials(colours, false);
  const group = new three.Group();
  group.add(box(mission.target_half_extents_body_m, solid("target"), edge));
  const port = new three.Group();
  const orange = solid("port");
  port.add(new three.Mesh(new three.TorusGeometry(0.075, 0.016, 12, 40), orange));
  const normal = new three.Mesh(new three.CylinderGeometry(0.004, 0.004, 0.4), orange);
  normal.rotateX(Math.PI / 2);
  normal.position.z = 0.2;
  port.add(normal);
  port.position.set(...mission.port_position_target_m);
  port.quaternion.setFromUnitVectors(FORWARD, new three.Vector3(...mission.port_normal_target));
  group.add(port);
  return group;
}

/** Bus and arm; `pose` places them by a state of the system's centre of mass. */
export class Servicer {
  constructor(mission, colours, isGhost = false) {
    this.mission = mission;
    this.group = new three.Group();
    const looks = materials(colours, isGhost);
    this.group.add(box(mission.bus_half_extents_body_m, looks.solid("bus"), looks.edge));
    const arm = { body: looks.solid("arm"), joint: looks.solid("joint"), tip: looks.solid("tip") };
    this.links = mission.links.map((link, i) => makeLink(mission, link, i, arm));
    this.group.add(...this.links);
  }

  pose({ position, attitude, jointAngle }) {
    const { points, attitudes, center } = posture(this.mission, jointAngle);
    place(this.group, sub(position, turned(attitude, center)), attitude);
    this.links.forEach((link, i) => place(link, points[i], attitudes[i]));
  }
}

/** A link as its capsule, the last one with the end effector at its end. */
function makeLink(mission, link, i, looks) {
  const group = new three.Group();
  const [tip, start] = [link.tip_from_joint_link_m, link.capsule_start_from_joint_link_m];
  const way = sub(add(tip, link.capsule_end_from_tip_link_m), start);
  const [whole, radius] = [norm(way), Math.max(link.radius_m, 0.01)];
  const isLast = i === mission.links.length - 1;
  const gripper = isLast ? mission.corridor_end_effector_length_m : 0;
  const length = Math.max(whole - gripper, 0);
  if (length > 0) {
    const capsule = along(new three.CapsuleGeometry(radius, length, 6, 20), looks.body, way, length);
    capsule.position.add(new three.Vector3(...start));
    group.add(capsule);
  }
  const housing = new three.CylinderGeometry(1.35 * radius, 1.35 * radius, 3 * radius, 28);
  group.add(along(housing, looks.joint, link.axis_link, 0));
  if (isLast) {
    group.add(endEffector(tip, norm(tip), Math.min(norm(tip), gripper), radius, looks.tip));
  }
  return group;
}

/** What narrows to the point that is to be at the port. */
function endEffector(way, whole, length, radius, material) {
  const group = new three.Group();
  const cone = along(new three.CylinderGeometry(0.25 * radius, 0.8 * radius, length, 24), material, way, length);
  const point = new three.Mesh(new three.SphereGeometry(0.3 * radius, 16, 12), material);
  const direction = new three.Vector3(...way).normalize();
  point.position.copy(direction).multiplyScalar(length);
  group.add(cone, point);
  group.position.copy(direction).multiplyScalar(whole - length);
  return group;
}

/** Outlines of bus and arm at one instant, as lines. */
export function outline(mission, material, state) {
  const { points, center } = posture(mission, state.jointAngle);
  const group = new three.Group();
  const geometry = new three.BoxGeometry(...mission.bus_half_extents_body_m.map((x) => 2 * x));
  group.add(new three.LineSegments(new three.EdgesGeometry(geometry), material));
  const pairs = points
    .slice(1)
    .flatMap((point, i) => [points[i], point])
    .map((point) => new three.Vector3(...point));
  const arm = new three.LineSegments(undefined, material);
  arm.geometry.setFromPoints(pairs);
  group.add(arm);
  place(group, sub(state.position, turned(state.attitude, center)), state.attitude);
  return group;
}

/** Another start: a point with its way to the target, whose box stands as it would. */
export function makeDraft(mission, scenario, colours) {
  const material = colours.of("start", new three.LineBasicMaterial());
  const [position, attitude] = [scenario.servicer_position_rtn_m, scenario.target_attitude_body_to_rtn];
  const group = new three.Group();
  const solid = colours.of("start", new three.MeshLambertMaterial());
  const point = new three.Mesh(new three.SphereGeometry(0.09, 24, 16), solid);
  point.position.set(...position);
  const way = new three.LineSegments(undefined, material);
  way.geometry.setFromPoints([new three.Vector3(...position), new three.Vector3()]);
  const half = mission.target_half_extents_body_m.map((x) => 2.04 * x);
  const target = new three.LineSegments(new three.EdgesGeometry(new three.BoxGeometry(...half)), material);
  target.quaternion.set(...attitude);
  group.add(point, way, target);
  return group;
}
