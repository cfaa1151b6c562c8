/** The 3-D views: viser's client in frames, told what to show; probabilities over the objects. */

import { byId, h, setText } from "../dom.js";
import { describeObjects, inWords } from "../objects.js";
import { Viewer } from "../viewer.js";
import { icon } from "./icons.js";
import { describe } from "./words.js";

/** One frame with its chip and tags. */
class Pane {
  constructor(session, index) {
    this.index = index;
    this.frame = /** @type {HTMLIFrameElement} */ (h("iframe", { class: "viewer", title: `3-D view ${index + 1}`, tabindex: -1, dataset: { testid: index ? `viewer-${index}` : "viewer" } }));
    this.tags = h("div", { class: "tags", "aria-hidden": "true" });
    this.chip = h("div", { class: "chip-card panel" });
    this.element = h("div", { class: "pane" }, this.frame, this.tags, this.chip);
    this.viewer = new Viewer(this.frame);
    this.source = `/review/view/${session}/${index}`;
    /** @type {null|{meta: any, arrays: Record<string, Float32Array>}} */
    this.trial = null;
    /** @type {Map<string, {element: HTMLElement, number: HTMLElement}>} */
    this.known = new Map();
    this.row = 0;
  }

  load() {
    this.viewer.open(this.source);
  }

  show(trial) {
    this.trial = trial;
    const { meta } = trial;
    const { hue, glyph } = describeObjects(meta).find(({ name }) => name === meta.instructed_goal) ?? describe(meta.instructed_goal);
    this.chip.replaceChildren(h("span", { class: "obj", dataset: { hue } }, icon(glyph, "k"), h("b", {}, inWords(meta.instructed_goal))), h("span", {}, inWords(meta.method)), h("span", { class: "dim" }, `${meta.participant}, trial ${meta.trial}`));
    this.known = new Map(describeObjects(meta).map(({ name, hue: own }) => {
      const number = h("span", { class: "num" });
      return [name, { number, element: h("div", { class: "tag", hidden: true, dataset: { hue: own } }, h("i"), number) }];
    }));
    this.tags.replaceChildren(...[...this.known.values()].map(({ element }) => element));
  }

  /** Each animation frame: tags follow the picture. */
  place(shown) {
    for (const [name, { element, number }] of this.known) {
      const belief = this.trial?.arrays[`belief.${name}`];
      const at = shown && belief ? this.viewer.project(`/tag/${name}`) : null;
      element.hidden = at === null;
      if (at === null) continue;
      setText(number, belief[this.row].toFixed(2));
      element.style.transform = `translate(${at[0].toFixed(1)}px, ${at[1].toFixed(1)}px) translate(-50%, -100%)`;
    }
  }
}

export class Views {
  /** @param {import("./socket.js").ReviewSocket} socket @param {string} session */
  constructor(socket, session) {
    this.socket = socket;
    this.session = session;
    /** @type {Pane[]} */
    this.panes = [];
    /** @type {string[]} ids of the trials shown */
    this.wanted = [];
    this.tags = true;
    const place = () => {
      for (const pane of this.panes.slice(0, this.wanted.length)) pane.place(this.tags);
      requestAnimationFrame(place);
    };
    requestAnimationFrame(place);
  }

  /** Show these trials, side by side; kept once all are drawn. */
  async open(trials) {
    this.wanted = trials.map(({ meta }) => meta.id);
    while (this.panes.length < trials.length) {
      const pane = new Pane(this.session, this.panes.length);
      this.panes.push(pane);
      byId("views").append(pane.element);
    }
    byId("views").dataset.count = String(trials.length);
    this.panes.forEach((pane, i) => { pane.element.hidden = i >= trials.length; });
    trials.forEach((trial, i) => this.panes[i].show(trial));
    await this.restore();
  }

  /** Let the worker draw what is wanted: at first, and again after it was replaced. */
  async restore() {
    if (!this.socket.ready || !this.wanted.length) return;
    const { wanted } = this;
    if (this.socket.views < wanted.length) await this.socket.command("views", { count: wanted.length });
    await Promise.all(wanted.map((trial, view) => this.socket.command("open", { view, trial })));
    wanted.forEach((_, i) => this.panes[i].load());
  }

  /** @param {number} view @param {number} step @param {number} row of the thinned curves */
  seek(view, step, row) {
    if (this.panes[view]) this.panes[view].row = row;
    this.socket.seek(step, view);
  }

  /** viser's insides of the first view, once it draws: canvas, scene, requestRender. */
  get picture() {
    const inside = /** @type {any} */ (this.panes[0]?.frame.contentWindow)?.__viserMutable;
    return inside?.canvas?.width > 0 ? inside : null;
  }
}
