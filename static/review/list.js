/** The table of all trials: filters, order, small pictures, and which are chosen to compare. */

import { byId, h, s, setAttribute, setHidden, setText } from "../dom.js";
import { inWords } from "../objects.js";
import { ask, Refusal } from "./api.js";
import { icon } from "./icons.js";
import { dateOf, describe, outcomeOf, titleOfTrial, tone } from "./words.js";

const POLL_MS = 2000;
const FILTERS = [
  ["study", "Study"], ["participant", "Person"], ["method", "Method"],
  ["instructed_goal", "Object"], ["outcome", "Outcome"], ["date", "Date"],
];
const COLUMNS = [
  { key: "compare", label: "Compare", unseen: true },
  { key: "title", label: "Trial", sort: (t) => `${t.participant} ${String(t.trial).padStart(6, "0")}` },
  { key: "method", label: "Method", sort: (t) => t.method },
  { key: "object", label: "Object", sort: (t) => t.instructed_goal },
  { key: "outcome", label: "Outcome", sort: (t) => outcomeOf(t) },
  { key: "path", label: "Path" },
  { key: "time", label: "Time s", right: true, sort: (t) => (t.steps ? t.duration_s : null) },
  { key: "input", label: "Input s", right: true, sort: (t) => (t.steps ? t.input_s : null) },
  { key: "opposed", label: "Opp. %", right: true, title: "Share of the pushing time in which assistance opposed the input", sort: (t) => t.opposed ?? null },
];
export const MOST_COMPARED = 4;

/** Events: `open` (detail: a trial), `compare` (the chosen ones changed), `trials` (the list changed). */
export class TrialList extends EventTarget {
  constructor() {
    super();
    this.trials = [];
    this.shown = [];
    this.current = "";
    this.compared = new Set();
    this.filters = Object.fromEntries(FILTERS.map(([key]) => [key, ""]));
    this.flagged = false;
    this.words = "";
    this.order = { key: "title", down: true };
    this.failed = "";
    /** @type {Map<string, {element: HTMLElement, text: string}>} */
    this.rows = new Map();
    this.#buildHeads();
    this.#buildFilters();
    byId("search").addEventListener("input", (event) => {
      this.words = /** @type {HTMLInputElement} */ (event.target).value.toLowerCase();
      this.render();
    });
    byId("rows").addEventListener("keydown", (event) => this.#key(event));
    this.#poll();
  }

  /** The trial with this id, as the list knows it. */
  find(id) {
    return this.trials.find((trial) => trial.id === id);
  }

  select(id) {
    this.current = id;
    this.render();
  }

  /** After a change of notes: show it before the next poll. */
  note(id, { flag, text }) {
    const trial = this.find(id);
    if (trial) Object.assign(trial, { flag, note: text });
    this.render();
  }

  /** The neighbour of the current trial among those shown. */
  neighbour(by) {
    const at = this.shown.findIndex((trial) => trial.id === this.current);
    return this.shown[Math.max(0, Math.min(this.shown.length - 1, at + by))];
  }

  async #poll() {
    try {
      const { folder, trials } = await (await ask("/api/review/trials")).json();
      this.trials = trials.map((trial) => ({ ...trial, date: dateOf(trial) }));
      this.failed = "";
      const people = new Set(trials.map((trial) => trial.participant)).size;
      setText(byId("folder"), `${folder}, ${people} ${people === 1 ? "participant" : "participants"}, ${trials.length} ${trials.length === 1 ? "trial" : "trials"}`);
      this.render();
      this.dispatchEvent(new Event("trials"));
    } catch (error) {
      this.failed = error instanceof Refusal ? error.message : "The list cannot be read.";
      this.render();
    }
    setTimeout(() => this.#poll(), document.hidden ? 5 * POLL_MS : POLL_MS);
  }

  #buildHeads() {
    byId("heads").replaceChildren(...COLUMNS.map((column) => {
      const cell = h("th", { scope: "col", class: column.right ? "rt" : null, title: column.title, dataset: { key: column.key } });
      if (column.sort) cell.append(h("button", { type: "button", on: { click: () => this.#sortBy(column.key) } }, column.label));
      else cell.append(h("span", { class: column.unseen ? "unseen" : null }, column.label));
      return cell;
    }));
  }

  #sortBy(key) {
    this.order = { key, down: this.order.key === key ? !this.order.down : key !== "title" };
    this.render();
  }

  #buildFilters() {
    const all = h("button", { type: "button", class: "chip", id: "filter-all", on: { click: () => this.#clear() } }, "All");
    const flagged = h("button", { type: "button", class: "chip", id: "filter-flagged", "aria-pressed": "false", on: { click: () => { this.flagged = !this.flagged; this.render(); } } }, icon("flag", "k"), "Flagged");
    const selects = FILTERS.map(([key, label]) => h("label", { class: "chip" }, h("span", { class: "unseen" }, label), h("select", { dataset: { filter: key }, on: { change: (event) => { this.filters[key] = event.target.value; this.render(); } } }, h("option", { value: "" }, label))));
    byId("filters").replaceChildren(all, ...selects, flagged);
  }

  #clear() {
    for (const key of Object.keys(this.filters)) this.filters[key] = "";
    this.flagged = false;
    this.words = /** @type {HTMLInputElement} */ (byId("search")).value = "";
    this.render();
  }

  #matches(trial) {
    if (this.flagged && !trial.flag) return false;
    if (FILTERS.some(([key]) => this.filters[key] && this.#value(trial, key) !== this.filters[key])) return false;
    if (!this.words) return true;
    const text = [trial.id, trial.participant, trial.instructed_goal, trial.method, trial.shown_as, outcomeOf(trial), trial.note].join(" ").toLowerCase();
    return this.words.split(/\s+/).every((word) => text.includes(word));
  }

  #value(trial, key) {
    return key === "outcome" ? outcomeOf(trial) : String(trial[key] ?? "");
  }

  render() {
    this.#renderFilters();
    const column = COLUMNS.find(({ key }) => key === this.order.key);
    const sign = this.order.down ? -1 : 1;
    const value = column.sort;
    this.shown = this.trials.filter((trial) => this.#matches(trial)).sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      if (x === null || y === null) return (x === null) - (y === null);
      return sign * (typeof x === "number" ? x - y : String(x).localeCompare(String(y)));
    });
    for (const cell of byId("heads").children) {
      const key = /** @type {HTMLElement} */ (cell).dataset.key;
      if (key === this.order.key) setAttribute(cell, "aria-sort", this.order.down ? "descending" : "ascending");
      else cell.removeAttribute("aria-sort");
    }
    this.#renderRows();
    const none = byId("none");
    setHidden(none, this.shown.length > 0 && !this.failed);
    setText(none, this.failed || (this.trials.length ? "No trial matches." : "No trials here yet. They appear as they finish."));
  }

  #renderFilters() {
    for (const select of byId("filters").querySelectorAll("select")) {
      const key = select.dataset.filter;
      const values = [...new Set(this.trials.map((trial) => this.#value(trial, key)))].filter(Boolean).sort();
      const known = [...select.options].slice(1).map((option) => option.value);
      if (values.join("\n") !== known.join("\n")) {
        select.replaceChildren(select.options[0], ...values.map((text) => h("option", { value: text }, inWords(text))));
      }
      if (select.value !== this.filters[key]) select.value = this.filters[key];
      setAttribute(select.parentElement, "data-on", this.filters[key] !== "");
      setHidden(select.parentElement, values.length < 2 && !this.filters[key]);
    }
    setAttribute(byId("filter-flagged"), "aria-pressed", this.flagged);
    setAttribute(byId("filter-all"), "aria-pressed", !this.flagged && Object.values(this.filters).every((text) => !text) && !this.words);
  }

  #renderRows() {
    const body = byId("rows");
    const wanted = this.shown.map((trial) => this.#row(trial));
    const focused = document.activeElement?.closest?.("tr")?.dataset.id;
    wanted.forEach((element, i) => {
      if (body.children[i] !== element) body.insertBefore(element, body.children[i] ?? null);
    });
    while (body.children.length > wanted.length) body.lastElementChild.remove();
    const reachable = this.shown.some(({ id }) => id === this.current) ? this.current : this.shown[0]?.id;
    for (const element of wanted) {
      const { id } = element.dataset;
      setAttribute(element, "aria-selected", id === this.current);
      setAttribute(element, "tabindex", id === (focused ?? reachable) ? 0 : -1);
      const box = element.querySelector("input");
      box.checked = this.compared.has(id);
    }
  }

  #row(trial) {
    const text = JSON.stringify(trial);
    const known = this.rows.get(trial.id);
    if (known?.text === text) return known.element;
    const element = known?.element ?? h("tr", { dataset: { testid: "trial-row", id: trial.id }, on: { click: () => this.#open(trial.id) } });
    this.rows.set(trial.id, { element, text });
    element.dataset.outcome = trial.problem ? "unusable" : trial.outcome;
    element.dataset.problem = trial.problem;
    element.dataset.flag = String(trial.flag);
    element.title = trial.problem || trial.id;
    const usable = isUsable(trial);
    setAttribute(element, "aria-disabled", !usable);
    const compare = h("input", { type: "checkbox", "aria-label": `Compare ${titleOfTrial(trial)}`, disabled: !usable, on: { click: (event) => event.stopPropagation(), change: (event) => this.#choose(trial.id, event.target) } });
    element.replaceChildren(h("td", {}, compare), ...(trial.problem ? [complaint(trial)] : cells(trial)));
    return element;
  }

  #choose(id, box) {
    if (box.checked && this.compared.size >= MOST_COMPARED) box.checked = false;
    else if (box.checked) this.compared.add(id);
    else this.compared.delete(id);
    this.dispatchEvent(new Event("compare"));
  }

  #open(id) {
    const trial = this.find(id);
    if (trial) this.dispatchEvent(new CustomEvent("open", { detail: trial }));
  }

  #key(event) {
    const row = event.target.closest("tr");
    if (!row || event.target !== row) return;
    const to = { ArrowDown: row.nextElementSibling, ArrowUp: row.previousElementSibling }[event.key];
    if (event.key === "Enter" || event.key === " ") this.#open(row.dataset.id);
    else if (to) {
      row.tabIndex = -1;
      to.tabIndex = 0;
      to.focus();
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }
}

/** Whether a trial can be opened. */
export const isUsable = (trial) => !trial.problem && trial.id.endsWith(".mcap");

/** What a row says of a trial. */
function cells(trial) {
  const { hue, glyph } = describe(trial.instructed_goal || "");
  const ran = trial.steps > 0;
  const outcome = h("td", { class: `oc ${tone(trial)}` }, h("span", {}, icon(tone(trial) === "ok" ? "check" : tone(trial) === "bad" ? "cross" : "info", "k"), outcomeOf(trial)));
  if (trial.flag) outcome.append(icon("flag", "k flagged"), h("span", { class: "unseen" }, "flagged"));
  return [
    h("td", { class: "num" }, titleOfTrial(trial)),
    h("td", {}, inWords(trial.method)),
    h("td", {}, h("span", { class: "obj", dataset: { hue } }, icon(glyph, "k"), inWords(trial.instructed_goal))),
    outcome,
    h("td", {}, trial.path ? picture(trial.path, hue) : null),
    h("td", { class: "rt num" }, ran ? trial.duration_s.toFixed(1) : "–"),
    h("td", { class: "rt num" }, ran ? trial.input_s.toFixed(1) : "–"),
    h("td", { class: "rt num" }, trial.opposed == null ? "–" : (100 * trial.opposed).toFixed(0)),
  ];
}

/** What is wrong with a log, in the place of all it cannot tell: "p01, trial-011 is torn: …". */
function complaint(trial) {
  const file = trial.id.split("/").at(-1).replace(/\.mcap(\.part)?$/, "");
  const name = [trial.participant, file].filter(Boolean).join(", ");
  const [before, after = ""] = trial.problem.includes(trial.id) ? trial.problem.split(trial.id, 2) : ["", `: ${trial.problem}`];
  return h("td", { class: "why", colspan: COLUMNS.length - 1 }, icon("cross", "k"), h("span", {}, before, h("b", {}, name), after));
}

/** The hand's path from above: away from the robot is up, the robot's left is left. */
function picture(path, hue) {
  const points = [];
  for (let i = 0; i < path.length; i += 2) points.push([-path[i + 1], -path[i]]);
  const line = points.map(([x, y], i) => `${i ? "L" : "M"}${x.toFixed(3)} ${y.toFixed(3)}`).join("");
  const [x, y] = points.at(-1);
  return s("svg", { class: "spark", viewBox: "-0.45 -0.92 0.9 0.66", role: "img", "aria-label": "path of the hand", "data-hue": hue },
    s("path", { d: line, "vector-effect": "non-scaling-stroke" }),
    s("circle", { cx: x, cy: y, r: 0.055 }));
}
