// Colours of the scene, light and dark: bus blue, arm green, port orange, as in every picture of this project.

import { Color } from "three";

const LIGHT = {
  bus: "#4f8fd0",
  arm: "#35a468",
  joint: "#1d6b42",
  tip: "#e07b16",
  target: "#aab4c0",
  port: "#e8820c",
  shell: "#7452a5",
  path: "#1f6fc4",
  way: "#2b9460",
  cone: "#c99a1a",
  edge: "#22303e",
  grid: "#8798aa",
  ghost: "#66788a",
  start: "#b3261e",
};
const DARK = {
  bus: "#5b9fe6",
  arm: "#46bd7c",
  joint: "#1f7d4d",
  tip: "#ffab4a",
  target: "#8a97a6",
  port: "#ffa033",
  shell: "#a98be0",
  path: "#6fb4ff",
  way: "#5fd49a",
  cone: "#ffd76a",
  edge: "#d7e2ee",
  grid: "#5a6b7d",
  ghost: "#b9c6d4",
  start: "#ff8f86",
};

/** Materials by the name of their colour, so that a change of theme reaches all of them. */
export class Colours {
  #materials = [];

  /** A material that has the colour `name` from now on. */
  of(name, material) {
    this.#materials.push([name, material]);
    return material;
  }

  set(isDark) {
    const colours = isDark ? DARK : LIGHT;
    for (const [name, material] of this.#materials) {
      const colour = new Color(colours[name]);
      material.uniforms?.colour ? material.uniforms.colour.value.copy(colour) : material.color.copy(colour);
    }
  }
}
