/** The timeline: input on top, the stacked belief below, events as marks; a slider for every hand. */

import { byId, h, s, setAttribute, setText } from "../dom.js";
import { describeObjects } from "../objects.js";
import { seconds } from "./words.js";

const WIDTH = 1000;
const POINTS = 250;
const LABEL_PX = 78;

export class Timeline {
  /** @param {import("./player.js").Player} player */
  constructor(player) {
    this.player = player;
    this.element = byId("timeline");
    this.marks = [];
    this.head = h("div", { class: "head" });
    const drag = (event) => {
      const box = this.element.getBoundingClientRect();
      const share = Math.max(0, Math.min(1, (event.clientX - box.left) / box.width));
      player.seek(Math.round(share * (player.steps - 1)));
    };
    this.element.addEventListener("pointerdown", (event) => {
      this.element.setPointerCapture(event.pointerId);
      player.pause();
      drag(event);
    });
    this.element.addEventListener("pointermove", (event) => {
      if (this.element.hasPointerCapture(event.pointerId)) drag(event);
    });
    player.addEventListener("moved", () => this.render());
    addEventListener("resize", () => this.#placeMarks());
  }

  /** @param {any} meta @param {Record<string, Float32Array>} arrays */
  load(meta, arrays) {
    const drawing = s("svg", { viewBox: `0 0 ${WIDTH} 34`, preserveAspectRatio: "none", "aria-hidden": "true" });
    drawing.append(...inputBars(arrays.input_norm), ...beliefBands(meta, arrays));
    this.element.replaceChildren(drawing, this.head);
    this.marks = meta.marks.filter(({ kind }) => kind !== "start");
    byId("marks").replaceChildren(...this.marks.map((mark) => {
      const at = seconds(this.player.secondsOf(mark.step));
      return h("button", { type: "button", class: "mark", title: `${mark.label}, ${at} s`, "aria-label": `${mark.label}, at ${at} s`, dataset: { step: mark.step, kind: mark.kind }, on: { click: () => this.player.seek(mark.step) } }, h("span", {}, mark.label));
    }));
    setAttribute(this.element, "aria-valuemin", seconds(this.player.secondsOf(0)).replace("−", "-"));
    setAttribute(this.element, "aria-valuemax", seconds(this.player.secondsOf(this.player.steps - 1)).replace("−", "-"));
    setText(byId("length"), ` / ${seconds(this.player.secondsOf(this.player.steps - 1))} s`);
    this.#placeMarks();
    this.render();
  }

  /** Jump to the event before or after the one we are at. */
  jump(by) {
    const at = this.player.step;
    const steps = [...new Set(this.marks.map(({ step }) => step))];
    const target = by > 0 ? steps.find((step) => step > at) : steps.reverse().find((step) => step < at);
    this.player.seek(target ?? (by > 0 ? this.player.steps - 1 : 0));
  }

  render() {
    const { player } = this;
    const share = player.steps > 1 ? player.step / (player.steps - 1) : 0;
    this.head.style.left = `${100 * share}%`;
    const now = player.seconds;
    setAttribute(this.element, "data-seconds", now.toFixed(3));
    setAttribute(this.element, "data-step", player.step);
    setAttribute(this.element, "aria-valuenow", now.toFixed(2));
    setAttribute(this.element, "aria-valuetext", `${now.toFixed(2)} seconds`);
    setText(byId("now"), seconds(now));
  }

  /** Labels that would overlap show their tick only; their name is in the title. */
  #placeMarks() {
    const width = this.element.clientWidth;
    let free = -Infinity;
    for (const button of byId("marks").children) {
      const mark = /** @type {HTMLElement} */ (button);
      const x = (Number(mark.dataset.step) / Math.max(1, this.player.steps - 1)) * width;
      mark.style.left = `${x}px`;
      const room = x >= free && x <= width - 12;
      mark.classList.toggle("bare", !room);
      if (room) free = x + Math.max(LABEL_PX, 6.2 * mark.textContent.length + 14);
    }
  }
}

function inputBars(norm) {
  const bars = [];
  let from = -1;
  for (let i = 0; i <= norm.length; i += 1) {
    const pushed = i < norm.length && norm[i] > 0;
    if (pushed && from < 0) from = i;
    if (!pushed && from >= 0) {
      const x = (from / norm.length) * WIDTH;
      bars.push(s("rect", { x, y: 0, width: Math.max(1, ((i - from) / norm.length) * WIDTH), height: 4, class: "input" }));
      from = -1;
    }
  }
  return bars;
}

function beliefBands(meta, arrays) {
  const objects = describeObjects(meta);
  const first = arrays[`belief.${meta.goals[0]}`];
  const n = Math.min(POINTS, first.length);
  const rows = Array.from({ length: n }, (_, i) => Math.round((i / Math.max(1, n - 1)) * (first.length - 1)));
  const below = new Array(n).fill(0);
  return meta.goals.map((goal) => {
    const values = arrays[`belief.${goal}`];
    const x = (i) => ((rows[i] / Math.max(1, first.length - 1)) * WIDTH).toFixed(1);
    const y = (share) => (8 + 26 * share).toFixed(2);
    const top = below.map((share, i) => `${x(i)} ${y(share)}`);
    rows.forEach((row, i) => { below[i] += values[row]; });
    const bottom = below.map((share, i) => `${x(i)} ${y(share)}`).reverse();
    const hue = objects.find(({ name }) => name === goal)?.hue ?? "goal-4";
    return s("path", { class: "band", "data-hue": hue, d: `M${top.join("L")}L${bottom.join("L")}Z` });
  });
}
