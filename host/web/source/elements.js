// Elements of the page, made in one go.

const SVG = "http://www.w3.org/2000/svg";

/** An element with attributes and contents. */
export function make(name, attributes = {}, ...contents) {
  return filled(document.createElement(name), attributes, contents);
}

/** The same of a drawing. */
export function draw(name, attributes = {}, ...contents) {
  return filled(document.createElementNS(SVG, name), attributes, contents);
}

function filled(element, attributes, contents) {
  for (const [name, value] of Object.entries(attributes)) {
    name.startsWith("on") ? element.addEventListener(name.slice(2), value) : element.setAttribute(name, value);
  }
  element.append(...contents.flat());
  return element;
}

export const byId = (id) => document.getElementById(id);
