// Colours of the scene, light and dark: bus blue, arm green, port orange, as in every picture of this project.

import { Color } from "three";

/** Colours by name: light, dark. */
const COLOURS = {
  bus: ["#4f8fd0", "#5b9fe6"],
  arm: ["#35a468", "#46bd7c"],
  joint: ["#1d6b42", "#1f7d4d"],
  tip: ["#e07b16", "#ffab4a"],
  target: ["#aab4c0", "#8a97a6"],
  port: ["#e8820c", "#ffa033"],
  shell: ["#7452a5", "#a98be0"],
  path: ["#1f6fc4", "#6fb4ff"],
  way: ["#2b9460", "#5fd49a"],
  cone: ["#c99a1a", "#ffd76a"],
  edge: ["#22303e", "#d7e2ee"],
  grid: ["#8798aa", "#5a6b7d"],
  ghost: ["#66788a", "#b9c6d4"],
  start: ["#b3261e", "#ff8f86"],
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
    for (const [name, material] of this.#materials) {
      const colour = new Color(COLOURS[name][isDark ? 1 : 0]);
      material.uniforms?.colour ? material.uniforms.colour.value.copy(colour) : material.color.copy(colour);
    }
  }
}
