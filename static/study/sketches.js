/** The pictures of the instructions, drawn as the trial shows things. */

import { s } from "../dom.js";

const DRAW = {
  sticks: () => [
    stick(90, "up", "down", "", "", 0, -26), word(90, 168, "left stick: height"),
    stick(330, "away", "near", "left", "right", 10, -22), word(330, 168, "right stick: over the table"),
  ],
  target: () => [
    s("path", { d: "M90 112 L330 112 L380 150 L40 150 Z", class: "table" }),
    s("ellipse", { cx: 236, cy: 130, rx: 40, ry: 11, class: "ring" }),
    s("path", { d: "M220 66 L252 66 L248 130 L224 130 Z", class: "glass" }),
    // The two fingers lie level, one on each side of the glass, as the real hand does.
    s("path", { d: "M60 88 L146 88 M156 74 L136 102 M156 74 L208 74 M136 102 L190 102", class: "hand" }),
    word(210, 172, "bring the open hand around the object with the ring, then close it"),
  ],
};

/** @param {"sticks"|"target"} name */
export function sketch(name) {
  return s("svg", { class: "sketch", viewBox: "0 0 420 184", role: "img", "aria-label": name === "sticks" ? "Left stick: up and down. Right stick: away, near, left, right." : "The hand reaches an object that has a ring around it." }, ...DRAW[name]());
}

function stick(x, north, south, west, east, dx, dy) {
  return s("g", {}, s("circle", { cx: x, cy: 78, r: 66, class: "pad" }), s("circle", { cx: x, cy: 78, r: 36, class: "inner" }),
    s("path", { d: `M${x} 78 l${dx} ${dy}`, class: "push" }), s("circle", { cx: x + dx, cy: 78 + dy, r: 20, class: "knob" }),
    word(x, 27, north), word(x, 138, south), word(x - 50, 82, west), word(x + 50, 82, east));
}

function word(x, y, text) {
  return s("text", { x, y, "text-anchor": "middle" }, text);
}
