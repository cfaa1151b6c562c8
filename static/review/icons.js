/** Icons of the review's own sprite, beside those of the live page. */

import { s } from "../dom.js";

const OWN = new Set(["lens", "full", "flag", "note", "share", "layers", "fork", "prev", "next", "play", "pause"]);

export const iconPath = (name) => (OWN.has(name) ? `/static/review/icons.svg#${name}` : `/static/icons.svg#${name}`);

/** @param {string} name @param {string} [className] */
export function icon(name, className = "i") {
  return s("svg", { class: className, "aria-hidden": "true" }, s("use", { href: iconPath(name) }));
}

/** Whether a button shows play or pause, and the like. */
export function setIcon(button, name) {
  const use = button.querySelector("use");
  if (use.getAttribute("href") !== iconPath(name)) use.setAttribute("href", iconPath(name));
}
