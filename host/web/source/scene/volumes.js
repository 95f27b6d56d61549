// What is no body: the keep-out shell, the camera's cone, rings that give the scale.

import * as three from "three";
import { RoundedBoxGeometry } from "three/addons/geometries/RoundedBoxGeometry.js";

const VERTEX = `
varying vec3 facing;
varying vec3 eye;
void main() {
  vec4 at = modelViewMatrix * vec4(position, 1.0);
  facing = normalMatrix * normal;
  eye = -at.xyz;
  gl_Position = projectionMatrix * at;
}`;
// Clear where one looks through, dense at the rim.
const FRAGMENT = `
uniform vec3 colour;
uniform float strength;
varying vec3 facing;
varying vec3 eye;
void main() {
  float rim = 1.0 - abs(dot(normalize(facing), normalize(eye)));
  gl_FragColor = vec4(colour, strength * (0.05 + 0.75 * rim * rim * rim));
  #include <colorspace_fragment>
}`;

/** Ends of two lines that cross at the origin. */
const CROSS = [[1, 0], [-1, 0], [0, 1], [0, -1]];

/** All points at a distance from the target's box: a box with round edges. */
function roundedBox(half, distance) {
  const [x, y, z] = half.map((length) => 2 * (length + distance));
  return new RoundedBoxGeometry(x, y, z, 12, distance);
}

/** The shells of the far and the near keep-out distance. */
export function makeShells(mission, colours) {
  const material = colours.of(
    "shell",
    new three.ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: { colour: { value: new three.Color() }, strength: { value: 0.55 } },
      transparent: true,
      depthWrite: false,
    }),
  );
  const shell = (distance) => {
    const mesh = new three.Mesh(roundedBox(mission.target_half_extents_body_m, distance), material);
    mesh.renderOrder = 3;
    return mesh;
  };
  return { far: shell(mission.keep_out_far_m), near: shell(mission.keep_out_near_m) };
}

/** The camera's cone of view, one metre long. */
export function makeCone(mission, colours) {
  const radius = Math.tan(Math.min(mission.field_of_view_half_angle_rad, 1.4));
  const geometry = new three.ConeGeometry(radius, 1, 64, 1, true);
  // From the tip at the origin along +z.
  geometry.translate(0, -0.5, 0).rotateX(-Math.PI / 2);
  const look = (kind, opacity) =>
    colours.of("cone", new kind({ transparent: true, depthWrite: false, side: three.DoubleSide, opacity }));
  const cone = new three.Mesh(geometry, look(three.MeshBasicMaterial, 0.09));
  cone.renderOrder = 2;
  const rim = new three.LineLoop(circle(radius, 1), look(three.LineBasicMaterial, 0.6));
  const sides = new three.BufferGeometry().setFromPoints(
    CROSS.flatMap(([x, y]) => [new three.Vector3(), new three.Vector3(x * radius, y * radius, 1)]),
  );
  const lines = new three.LineSegments(sides, look(three.LineBasicMaterial, 0.28));
  const group = new three.Group();
  group.add(cone, rim, lines);
  return group;
}

function circle(radius, z, count = 128) {
  const points = Array.from({ length: count }, (_, i) => {
    const angle = (2 * Math.PI * i) / count;
    return new three.Vector3(radius * Math.cos(angle), radius * Math.sin(angle), z);
  });
  return new three.BufferGeometry().setFromPoints(points);
}

/** Rings about the target in the orbit's plane, a metre apart, every second one stronger. */
export function makeRings(reach, colours) {
  const group = new three.Group();
  const [faint, strong] = [0.16, 0.38].map((opacity) =>
    colours.of("grid", new three.LineBasicMaterial({ transparent: true, opacity, depthWrite: false })),
  );
  const rings = Math.max(2, Math.ceil(reach));
  for (let radius = 1; radius <= rings; radius++) {
    group.add(new three.LineLoop(circle(radius, 0), radius % 2 ? faint : strong));
  }
  const axes = CROSS.map(([x, y]) => new three.Vector3(x * rings, y * rings, 0));
  group.add(new three.LineSegments(new three.BufferGeometry().setFromPoints(axes), faint));
  return group;
}
