/** The signals beside the replay: one uPlot a panel, one playhead through all of them. */

import { h, s, setText } from "../dom.js";
import { describeObjects } from "../objects.js";
import { rowOf } from "./steps.js";

const HEIGHT = 104;
const DETAIL_MS = 250;
const MISSING = "The plotting library is not installed: it was fetched neither at installation nor since. Run `make plots` in Hindsight's folder (it needs the network once), then load this page again. Everything else works without it.";
const DASHES = { known: [5, 4], "what-if": [9, 4], "trial:1": [9, 4], "trial:2": [3, 3], "trial:3": [12, 3, 2, 3] };

/** @type {Promise<any>} uPlot is fetched at installation and may be missing. */
const library = import("/static/vendor/uplot/uPlot.esm.js").then((module) => module.default, () => null);

/** One plot, made when it first comes into sight. */
class Panel {
  constructor(plots, about) {
    this.plots = plots;
    this.about = about;
    this.value = h("span", { class: "num dim" });
    this.body = h("div", { class: "plot" });
    this.legend = h("span", { class: "legend" });
    this.element = h("section", { class: "panel-plot", "aria-label": about.title, dataset: { key: about.key } }, h("header", {}, h("h3", {}, about.title), this.legend, this.value), this.body);
    this.head = h("div", { class: "playhead" });
    this.plot = null;
  }

  /** Curves: the trial's own, then what would have been. */
  curves() {
    const { alternative, comparison, trial } = this.plots;
    const own = this.about.curves.map((curve) => ({ ...curve, values: (comparison ?? trial).arrays[curve.array] }));
    if (!alternative) return own;
    const recomputed = this.about.curves.filter(({ array, role }) => alternative.arrays[array] && role !== "known" && role !== "user");
    return [...own, ...recomputed.map((curve) => ({ array: curve.array, name: `${curve.name}, ${alternative.name}`, alternative: true, role: curve.role.startsWith("goal:") ? curve.role : "line", dash: DASHES["what-if"], values: this.plots.resample(alternative.arrays[curve.array]) }))];
  }

  make(uPlot) {
    this.drop();
    const { plots } = this;
    const style = getComputedStyle(document.documentElement);
    const curves = this.curves();
    const colour = (role) => style.getPropertyValue(plots.variable(role)).trim();
    const named = curves.filter(({ role, alternative }) => !alternative && (this.about.curves.length > 1 || role !== "line"));
    const entries = named.map(({ name, role }) => h("span", {}, swatch(colour(role), DASHES[role]), name));
    if (named.length < curves.length && plots.alternative) entries.push(h("span", {}, swatch(colour("line"), DASHES["what-if"]), plots.alternative.name));
    this.legend.replaceChildren(...entries);
    const axis = { stroke: style.getPropertyValue("--text-3").trim(), grid: { stroke: style.getPropertyValue("--line").trim(), width: 1 }, ticks: { show: false }, font: "11px system-ui, sans-serif" };
    const x = plots.zoom ?? { min: plots.x[0], max: plots.x.at(-1) };
    this.plot = new uPlot({
      width: Math.max(60, this.body.clientWidth),
      height: HEIGHT,
      legend: { show: false },
      padding: [4, 6, 0, 0],
      cursor: { sync: { key: "review", setSeries: false }, points: { show: false }, drag: { x: true, y: false, setScale: false }, bind: { dblclick: () => () => { plots.zoomTo(null); return null; } } },
      select: { show: true },
      scales: { x: { time: false, range: () => [x.min, x.max] }, y: { range: (_, low, high) => padded(low, high) } },
      axes: [{ ...axis, size: 20, space: 60, gap: 2, values: plots.comparison?.distance ? (_, ticks) => ticks.map((tick) => (-tick).toFixed(2)) : undefined }, { ...axis, size: 44, space: 28, gap: 3 }],
      series: [{}, ...curves.map(({ name, role, dash }) => ({ label: name, stroke: colour(role), width: 1.5, dash: dash ?? DASHES[role], points: { show: false } }))],
      hooks: { setSelect: [(plot) => this.#selected(plot)], ready: [(plot) => this.#ready(plot)] },
    }, [plots.x, ...curves.map(({ values }) => values)], this.body);
    this.follow();
  }

  #ready(plot) {
    plot.over.append(this.head);
    let from = null;
    plot.over.addEventListener("mousedown", (event) => { from = event.clientX; });
    plot.over.addEventListener("click", (event) => {
      if (from === null || Math.abs(event.clientX - from) > 4) return;
      const box = plot.over.getBoundingClientRect();
      this.plots.player.pause();
      this.plots.player.seek(this.plots.stepAt(plot.posToVal(event.clientX - box.left, "x")));
    });
  }

  #selected(plot) {
    const { left, width } = plot.select;
    if (width < 6) return;
    const [min, max] = [plot.posToVal(left, "x"), plot.posToVal(left + width, "x")];
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.plots.zoomTo({ min, max });
  }

  /** The number in the corner is the first curve's; among goals it is the instructed one's. */
  follow() {
    const { plots } = this;
    const wanted = plots.trial?.meta.instructed_goal;
    const curve = this.about.curves.find(({ role }) => role === `goal:${wanted}` && this.about.curves[0].role.startsWith("goal:")) ?? this.about.curves[0];
    const first = (plots.comparison ?? plots.trial)?.arrays[curve.array];
    if (first) setText(this.value, `${number(first[plots.row] ?? NaN)} ${this.about.unit}`.trim());
    if (!this.plot) return;
    const at = this.plot.valToPos(plots.position, "x");
    this.head.style.transform = `translateX(${at.toFixed(1)}px)`;
    this.head.hidden = !(at >= 0 && at <= this.plot.over.clientWidth);
  }

  drop() {
    this.plot?.destroy();
    this.plot = null;
  }
}

export class Plots {
  /** @param {HTMLElement} parent @param {import("./player.js").Player} player */
  constructor(parent, player) {
    this.parent = parent;
    this.player = player;
    this.full = null;
    this.trial = null;
    this.alternative = null;
    this.zoom = null;
    this.x = [];
    this.row = 0;
    this.position = 0;
    this.fetchDetail = null;
    /** @type {any} set by the page */
    this.page = null;
    /** @type {any} several trials over one axis, or null */
    this.comparison = null;
    /** @type {Panel[]} */
    this.panels = [];
    this.seen = new IntersectionObserver((entries) => this.#appeared(entries), { root: parent, rootMargin: "120px" });
    let width = 0;
    new ResizeObserver(() => {
      if (Math.abs(parent.clientWidth - width) < 2) return;
      width = parent.clientWidth;
      this.restyle();
    }).observe(parent);
  }

  /** Show a trial's curves. */
  load(trial) {
    this.full = this.trial = trial;
    this.alternative = this.comparison = null;
    this.zoom = null;
    this.x = trial.arrays.seconds;
    this.#build(trial.meta.panels);
  }

  /** Curves of several trials in the same place. */
  compare(comparison) {
    this.comparison = comparison;
    this.alternative = null;
    this.zoom = null;
    this.x = comparison.x;
    this.#build(comparison.panels);
  }

  #build(panels) {
    for (const panel of this.panels) panel.drop();
    this.seen.disconnect();
    this.panels = panels.map((about) => new Panel(this, about));
    this.parent.replaceChildren(...this.panels.map(({ element }) => element));
    for (const { element } of this.panels) this.seen.observe(element);
    library.then((uPlot) => {
      if (!uPlot && !this.parent.querySelector(".missing")) this.parent.prepend(h("p", { class: "missing" }, MISSING));
    });
    this.follow(this.player.step);
  }

  async #appeared(entries) {
    const uPlot = await library;
    if (!uPlot || !this.trial) return;
    for (const { target, isIntersecting } of entries) {
      const panel = this.panels.find(({ element }) => element === target);
      if (!panel) continue;
      if (isIntersecting && !panel.plot) panel.make(uPlot);
      else if (!isIntersecting) panel.drop();
    }
  }

  /** Draw again what is in sight: another theme, width, zoom or alternative. */
  async restyle() {
    const uPlot = await library;
    if (!uPlot || !this.trial) return;
    for (const panel of this.panels) if (panel.plot) panel.make(uPlot);
  }

  /** @param {null|{name: string, arrays: Record<string, Float32Array>}} alternative */
  setAlternative(alternative) {
    this.alternative = alternative;
    this.restyle();
  }

  /** Values of an alternative at the steps of the curves shown, which may be thinned otherwise. */
  resample(values) {
    const steps = this.alternative.arrays.step;
    let k = 0;
    return Float32Array.from(this.trial.arrays.step, (step) => {
      while (k + 1 < steps.length && steps[k + 1] <= step) k += 1;
      return values[k];
    });
  }

  /** @param {null|{min: number, max: number}} range of time [s]; null: all */
  zoomTo(range) {
    this.zoom = range && range.max > range.min ? range : null;
    clearTimeout(this.fetchDetail);
    if (this.comparison) {
      this.restyle();
      return;
    }
    this.#show(this.full);
    if (!this.zoom || this.full.meta.stride === 1) return;
    const asked = this.zoom;
    this.fetchDetail = setTimeout(async () => {
      const detail = await this.page.fetchSignals(this.full.meta.id, { first: this.player.stepOf(asked.min), last: this.player.stepOf(asked.max) }).catch(() => null);
      if (detail && this.zoom === asked) this.#show(detail);
    }, DETAIL_MS);
  }

  #show(trial) {
    this.trial = trial;
    this.x = trial.arrays.seconds;
    this.row = rowOf(trial, this.player.step);
    this.restyle();
  }

  /** @param {number} step */
  follow(step) {
    if (!this.trial) return;
    this.position = this.player.secondsOf(step);
    this.row = rowOf(this.trial, step);
    if (this.comparison) {
      const { x } = this.comparison;
      this.position = this.page.compare.position(step);
      this.row = Math.max(0, Math.min(x.length - 1, Math.round(((this.position - x[0]) / (x.at(-1) - x[0])) * (x.length - 1))));
    }
    for (const panel of this.panels) panel.follow();
  }

  /** The step of the (first) trial at a place of the axis. */
  stepAt(x) {
    return this.comparison ? this.page.compare.stepAt(x) : this.player.stepOf(x);
  }

  /** The style sheet's variable for a curve's role. */
  variable(role) {
    if (role === "user") return "--user";
    if (role === "assist" || role === "known") return "--assist";
    if (role === "trial:0") return "--text";
    if (!role.startsWith("goal:")) return "--text-2";
    const object = describeObjects(this.full.meta).find(({ name }) => `goal:${name}` === role);
    return `--${object?.hue ?? "text-2"}`;
  }
}

/** A piece of the curve as it is drawn, dashes included. */
function swatch(colour, dash) {
  return s("svg", { viewBox: "0 0 24 2", "aria-hidden": "true" }, s("path", { d: "M0 1H24", style: `stroke:${colour}`, "stroke-dasharray": dash?.join(" ") ?? "none" }));
}

/** A curve that never moves still gets a scale around it; zero stays in sight where it is near. */
function padded(low, high) {
  if (low === null || high === null) return [0, 1];
  const room = Math.max(0.08 * (high - low), 1e-4 * Math.max(Math.abs(low), Math.abs(high)), 1e-6);
  return [low >= 0 && low < high ? Math.min(0, low) : low - room, high + room];
}

function number(value) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  const digits = size >= 100 ? 0 : size >= 10 ? 1 : size >= 0.095 || size === 0 ? 2 : 3;
  return value.toFixed(digits).replace("-", "−");
}
