// Paths as lines of a width in pixels, the part that has passed stronger than what is to come.

import { Group } from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";

export class Path {
  /** Through points at `times` [s]. */
  constructor(points, times, look) {
    const { colours, colour, width, isDashed = false } = look;
    this.times = times;
    this.group = new Group();
    const line = (opacity, thickness) => {
      const geometry = new LineGeometry().setPositions(points.flat());
      const dashes = { dashed: isDashed, dashSize: 0.08, gapSize: 0.06 };
      const seen = { linewidth: thickness, transparent: true, opacity, depthWrite: false };
      const path = new Line2(geometry, colours.of(colour, new LineMaterial({ ...seen, ...dashes })));
      if (isDashed) {
        path.computeLineDistances();
      }
      path.renderOrder = 4;
      this.group.add(path);
      return path;
    };
    this.whole = line(0.4, width);
    this.passed = line(1, 1.6 * width);
  }

  /** Shows what has passed by a time [s]. */
  set(time) {
    const passed = this.times.filter((at) => at <= time).length - 1;
    this.passed.geometry.instanceCount = Math.max(passed, 0);
  }
}
