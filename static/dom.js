/** Building and touching elements; text only ever becomes text. */

const SVG = "http://www.w3.org/2000/svg";

/**
 * An element with properties (`class`, `dataset`, `on`, aria and other attributes) and children.
 * @param {string} tag
 * @param {Record<string, any>} [props]
 * @param {...(Node|string|null)} children
 * @returns {HTMLElement}
 */
export function h(tag, props = {}, ...children) {
  return fill(document.createElement(tag), props, children);
}

/** The same in SVG. */
export function s(tag, props = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), props, children);
}

function fill(element, props, children) {
  for (const [name, value] of Object.entries(props)) {
    if (value === null || value === undefined || value === false) continue;
    if (name === "on") for (const [event, act] of Object.entries(value)) element.addEventListener(event, act);
    else if (name === "dataset") Object.assign(element.dataset, value);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children.filter((child) => child !== null));
  return element;
}

/** An icon of the sprite. */
export function icon(name, className = "i") {
  return s("svg", { class: className, "aria-hidden": "true" }, s("use", { href: iconPath(name) }));
}

export function setIcon(svg, name) {
  setAttribute(svg.firstElementChild, "href", iconPath(name));
}

function iconPath(name) {
  return `/static/icons.svg#${name}`;
}

// The render runs each frame: touch the document only where something changed.
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function setAttribute(element, name, value) {
  const text = String(value);
  if (element.getAttribute(name) !== text) element.setAttribute(name, text);
}

export function setHidden(element, hidden) {
  if (element.hidden !== hidden) element.hidden = hidden;
}

/** @param {string} id */
export const byId = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
