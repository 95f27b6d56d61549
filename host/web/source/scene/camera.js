// Where one looks from: free around the scene, or along with the servicer, the port or the camera.

import { PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { port } from "../kinematics.js";
import { cross, dot, norm, turned, unit } from "../vectors.js";

const FIELD = 34;
/** Room about what is seen. */
const MARGIN = 1.1;
export const VIEWS = ["overview", "beside", "port", "camera"];

export class Viewpoint {
  constructor(element, changed) {
    this.camera = new PerspectiveCamera(FIELD, 1, 0.02, 400);
    this.controls = new OrbitControls(this.camera, element);
    this.controls.enableDamping = false;
    this.controls.minDistance = 0.4;
    this.controls.maxDistance = 120;
    this.controls.addEventListener("change", changed);
    this.controls.addEventListener("start", () => (this.isMoved = true));
    this.view = "overview";
  }

  /** Takes the plan in: which way is up, and how far away all of it is seen. */
  show(plan) {
    const path = plan.file.stage1.position_rtn_m;
    this.start = path[0];
    const bus = norm(plan.mission.bus_half_extents_body_m);
    const box = norm(plan.mission.target_half_extents_body_m) + 0.85 * plan.mission.keep_out_far_m;
    this.spheres = [...path.map((point) => [point, bus]), [[0, 0, 0], box]];
    const way = unit(this.start);
    this.up = Math.abs(way[2]) > 0.8 ? [1, 0, 0] : [0, 0, 1];
    this.camera.up.set(...this.up);
    this.choose(this.view);
  }

  /** Chooses a view; the free one starts from the side, with all of the path in sight. */
  choose(view) {
    this.view = view;
    this.isMoved = false;
    this.controls.enabled = view === "overview" || view === "beside";
    this.camera.fov = view === "camera" || view === "port" ? 50 : FIELD;
    this.camera.up.set(...this.up);
    if (view === "overview") {
      this.#overview();
    }
    this.camera.updateProjectionMatrix();
    this.follows = null;
  }

  #overview() {
    const way = unit(this.start);
    const side = unit(cross(way, this.up));
    const above = unit(cross(side, way));
    const from = unit([0, 1, 2].map((i) => 0.92 * side[i] + 0.42 * above[i] + 0.28 * way[i]));
    const { middle, away } = this.#fit(from);
    this.camera.position.set(...middle.map((x, i) => x + away * from[i]));
    this.controls.target.set(...middle);
    this.controls.update();
  }

  /** From how far all is seen, and what is then in the middle: by spheres about all there is. */
  #fit(from) {
    const right = unit(cross(this.up, from));
    const above = cross(from, right);
    const vertical = Math.tan((FIELD * Math.PI) / 360);
    const slopes = [vertical * this.camera.aspect, vertical];
    const spans = [right, above].map((axis) => {
      const ends = this.spheres.flatMap(([point, radius]) => [-1, 1].map((sign) => dot(point, axis) + sign * radius));
      return [Math.min(...ends), Math.max(...ends)];
    });
    const middle = [right, above].reduce(
      (sum, axis, i) => {
        const centre = (spans[i][0] + spans[i][1]) / 2;
        return sum.map((x, k) => x + centre * axis[k]);
      },
      [0, 0, 0],
    );
    const needed = this.spheres.flatMap(([point, radius]) =>
      [right, above].map((axis, i) => {
        const off = Math.abs(dot(point, axis) - dot(middle, axis)) + radius;
        return dot(point, from) + (MARGIN * off) / slopes[i];
      }),
    );
    return { middle, away: Math.max(...needed) };
  }

  /** Takes a new shape of the picture; an overview that nobody moved fits again. */
  resize(aspect) {
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
    if (this.view === "overview" && !this.isMoved) {
      this.#overview();
    }
  }

  /** Goes along with what is looked at. */
  follow(mission, state, targetAttitude) {
    const looks = { beside: this.#beside, port: this.#port, camera: this.#camera };
    looks[this.view]?.call(this, mission, state, targetAttitude);
  }

  /** Beside the servicer, moving along with it; one may turn about it. */
  #beside(mission, state) {
    const at = new Vector3(...state.position);
    if (this.follows) {
      this.camera.position.add(at.clone().sub(this.follows));
    } else {
      const way = unit(state.position);
      const side = unit(cross(way, this.up));
      const offset = [0, 1, 2].map((i) => 4.4 * side[i] + 1.9 * this.up[i] + 0.6 * way[i]);
      this.camera.position.copy(at).add(new Vector3(...offset));
    }
    this.follows = at;
    this.controls.target.copy(at).multiplyScalar(1 - Math.min(0.45, 0.7 / at.length()));
    this.controls.update();
  }

  /** From beside the port towards the servicer. */
  #port(mission, state, targetAttitude) {
    const normal = turned(targetAttitude, mission.port_normal_target);
    const across = this.#across(normal);
    const from = port(mission, targetAttitude).map((x, i) => x + 0.12 * normal[i] + 0.62 * across[i]);
    this.#look(from, state.position, across);
  }

  /** Along the boresight, from behind the centre of mass. */
  #camera(mission, { position, attitude }) {
    const boresight = turned(attitude, mission.boresight_bus);
    const across = turned(attitude, Math.abs(mission.boresight_bus[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]);
    const from = position.map((x, i) => x + 0.62 * boresight[i] + 0.34 * across[i]);
    this.#look(
      from,
      position.map((x, i) => x + 2 * boresight[i]),
      across,
    );
  }

  #across(normal) {
    const part = dot(this.up, normal);
    const across = this.up.map((x, i) => x - part * normal[i]);
    return norm(across) > 1e-3 ? unit(across) : unit(cross(normal, [1, 0, 0]));
  }

  #look(from, to, up) {
    this.camera.position.set(...from);
    this.camera.up.set(...up);
    this.camera.lookAt(...to);
  }
}
