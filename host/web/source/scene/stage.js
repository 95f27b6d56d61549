// The three-dimensional picture: what there is of a plan and a flight, drawn when something changes.

import { DirectionalLight, Group, HemisphereLight, LineBasicMaterial, Scene, WebGLRenderer } from "three";
import { Servicer, makeDraft, makeTarget, outline, place } from "./bodies.js";
import { Viewpoint } from "./camera.js";
import { Colours } from "./colours.js";
import { Path } from "./paths.js";
import { makeCone, makeRings, makeShells } from "./volumes.js";
import { endEffector } from "../kinematics.js";
import { norm, turned } from "../vectors.js";

/** Shares of the time at which outlines of the servicer stay in the picture. */
const STOPS = [0, 0.34, 0.59, 0.8, 0.92];

export class Stage {
  /** In a canvas with its context; `drawn` is called after every picture. */
  constructor(canvas, context, drawn) {
    this.renderer = new WebGLRenderer({ canvas, context, antialias: true, alpha: true });
    this.renderer.setClearAlpha(0);
    // Asking whether shaders are sound makes the first picture wait for each of them.
    this.renderer.debug.checkShaderErrors = false;
    this.canvas = canvas;
    this.drawn = drawn;
    this.scene = new Scene();
    this.viewpoint = new Viewpoint(canvas, () => this.draw());
    this.sky = new HemisphereLight(0xffffff, 0x6a7480, 1.9);
    this.sun = new DirectionalLight(0xffffff, 1.7);
    this.scene.add(this.sky, this.sun);
    this.hidden = new Set();
    new ResizeObserver(() => this.#resize()).observe(canvas.parentElement);
  }

  /** Takes a plan, and a flight of it where there is one, in place of what was there. */
  show(plan, flight) {
    this.#clear();
    Object.assign(this, { plan, flight, colours: new Colours() });
    const { mission } = plan;
    const { colours } = this;
    this.parts = {
      target: makeTarget(mission, colours),
      servicer: new Servicer(mission, colours),
      ghost: flight ? new Servicer(mission, colours, true) : null,
      shells: makeShells(mission, colours),
      cone: makeCone(mission, colours),
      paths: this.#paths(plan, flight),
      stops: this.#stops(plan),
      rings: makeRings(norm(plan.node(0).position), colours),
    };
    const { target, servicer, ghost, shells, cone, paths, stops, rings } = this.parts;
    const ghosts = ghost ? [ghost.group] : [];
    this.world = new Group();
    this.world.add(target, servicer.group, ...ghosts, shells.far, shells.near, cone, stops, rings);
    this.world.add(...paths.map((path) => path.group));
    this.scene.add(this.world);
    this.colours.set(this.isDark);
    this.viewpoint.show(plan);
    this.set(this.time ?? 0);
    this.#resize();
  }

  #paths(plan, flight) {
    const { colours } = this;
    const times = plan.instants(4);
    const states = times.map((time) => plan.at(time));
    const centre = states.map((state) => state.position);
    const tips = states.map((state) => endEffector(plan.mission, state));
    const planned = (points, colour, width) =>
      new Path(points, times, { colours, colour: flight ? "ghost" : colour, width, isDashed: Boolean(flight) });
    const paths = [planned(centre, "path", 1.8), planned(tips, "way", 1.2)];
    if (flight) {
      const [flown, flownTips] = flight.paths();
      paths.push(new Path(flown, flight.times, { colours, colour: "path", width: 1.8 }));
      paths.push(new Path(flownTips, flight.times, { colours, colour: "way", width: 1.2 }));
    }
    return paths;
  }

  #stops(plan) {
    const look = { transparent: true, opacity: 0.34, depthWrite: false };
    const material = this.colours.of("ghost", new LineBasicMaterial(look));
    const group = new Group();
    group.add(...STOPS.map((share) => outline(plan.mission, material, plan.at(share * plan.duration))));
    return group;
  }

  /** Marks another start, and the target as it would stand there; nothing where there is none. */
  draft(scenario) {
    this.drafted?.removeFromParent();
    this.drafted = scenario && makeDraft(this.plan.mission, scenario, this.colours);
    if (scenario) {
      this.colours.set(this.isDark);
      this.world.add(this.drafted);
    }
    this.draw();
  }

  #clear() {
    if (!this.world) {
      return;
    }
    this.scene.remove(this.world);
    this.world.traverse((object) => {
      object.geometry?.dispose();
      object.material?.dispose?.();
    });
  }

  /** What is shown at a time [s]. */
  set(time) {
    this.time = time;
    const { plan, flight, parts } = this;
    const shown = flight ?? plan;
    const [state, attitude] = [shown.at(time), shown.targetAt(time)];
    place(parts.target, [0, 0, 0], attitude);
    parts.servicer.pose(state);
    parts.ghost?.pose(plan.at(time));
    parts.paths.forEach((path) => path.set(time));
    this.#volumes(state, attitude);
    this.viewpoint.follow(plan.mission, state, attitude);
    this.draw();
  }

  #volumes(state, attitude) {
    const { shells, cone, ghost, stops, paths, rings } = this.parts;
    const isFar = this.plan.keepOut(this.time) === this.plan.mission.keep_out_far_m;
    const show = (name, object, isUseful = true) => (object.visible = isUseful && !this.hidden.has(name));
    place(shells.far, [0, 0, 0], attitude);
    place(shells.near, [0, 0, 0], attitude);
    show("shell", shells.far, isFar);
    show("shell", shells.near, !isFar);
    show("cone", cone, this.viewpoint.view !== "camera");
    show("stops", stops);
    show("rings", rings);
    show("ghost", ghost?.group ?? {});
    paths.forEach((path) => show("path", path.group));
    place(cone, state.position, state.attitude);
    cone.lookAt(...state.position.map((x, i) => x + turned(state.attitude, this.plan.mission.boresight_bus)[i]));
    const length = norm(state.position);
    cone.scale.setScalar(Math.max(length, 0.5));
  }

  /** Shows or hides a part by its name in the legend. */
  toggle(name, isShown) {
    isShown ? this.hidden.delete(name) : this.hidden.add(name);
    this.set(this.time);
  }

  /** Looks at it another way. */
  look(view) {
    this.viewpoint.view = view;
    if (this.plan) {
      this.viewpoint.choose(view);
      this.set(this.time);
    }
  }

  theme(isDark) {
    this.isDark = isDark;
    this.sky.intensity = isDark ? 1.35 : 2.1;
    this.sun.intensity = isDark ? 1.9 : 1.6;
    this.colours?.set(isDark);
    this.draw();
  }

  /** Takes the size of its place. A new size empties the canvas: the picture is drawn again within the same frame. */
  #resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    const size = [width, height, Math.min(devicePixelRatio, 2)];
    if (!this.plan || width === 0 || height === 0 || String(size) === String(this.size)) {
      return;
    }
    this.size = size;
    this.renderer.setPixelRatio(size[2]);
    this.renderer.setSize(width, height, false);
    this.viewpoint.resize(width / height);
    this.#render();
  }

  /** Draws with the next frame, once. */
  draw() {
    if (this.plan) {
      this.pending ??= requestAnimationFrame(() => this.#render());
    }
  }

  #render() {
    cancelAnimationFrame(this.pending);
    this.pending = null;
    const { camera } = this.viewpoint;
    // The sun stands behind the left shoulder of whoever looks.
    this.sun.position.set(-0.6, 0.9, 0.8).applyQuaternion(camera.quaternion);
    this.renderer.render(this.scene, camera);
    this.drawn(camera);
  }
}
