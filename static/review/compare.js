/** Two to four trials side by side, aligned by time, by distance to the goal, or by an event. */

import { byId, h, setAttribute, setText } from "../dom.js";
import { comparisonOf, distanceTable } from "./alignment.js";
import { originOf, rowOf } from "./steps.js";

export function createCompare(page) {
  const button = byId("compare");
  const choice = /** @type {HTMLSelectElement} */ (h("select", { dataset: { testid: "compare-by" }, "aria-label": "Align by" }));
  const bar = h("div", { class: "compare-bar panel", hidden: true }, h("label", {}, "Aligned by ", choice), h("button", { type: "button", class: "btn line small", on: { click: () => stop() } }, "Close"));
  byId("views").parentElement.append(bar);
  /** @type {{meta: any, arrays: any}[]} */
  let trials = [];
  let tables = [];
  let on = false;
  let run = 0;

  const update = () => {
    const n = page.list.compared.size;
    setText(button, n ? `Compare ${n}` : "Compare");
    setAttribute(button, "aria-disabled", n < 2);
    setText(byId("compare-hint"), n < 2 ? "Tick two to four trials in the table first." : `${n} trials are ticked.`);
  };

  const start = async () => {
    const ids = [...page.list.compared];
    if (ids.length < 2) {
      page.say("Tick two to four trials in the table first.", "wait");
      return;
    }
    const mine = (run += 1);
    const note = page.say("Opening …", "wait");
    try {
      const found = await Promise.all(ids.map((id) => page.fetchSignals(id)));
      note.remove();
      if (mine !== run) return;
      trials = found;
      tables = trials.map(distanceTable);
      page.trial = trials[0];
      page.show(trials[0]);
      page.whatIf.close();
      on = true;
      bar.hidden = false;
      document.body.dataset.comparing = String(trials.length);
      const events = shared(trials);
      choice.replaceChildren(h("option", { value: "time" }, "time"), h("option", { value: "distance" }, "distance to the goal"), ...events.map((label) => h("option", { value: `event:${label}` }, `event: ${label}`)));
      draw();
      await page.views.open(trials);
      follow(page.player.step);
    } catch (error) {
      note.remove();
      page.say(/** @type {Error} */ (error).message);
    }
  };

  const draw = () => {
    page.plots.compare(comparisonOf(trials, tables, choice.value || "time"));
    follow(page.player.step);
  };

  /** The step of each trial that belongs beside the first one's. */
  const aligned = (step) => trials.map((trial, i) => (i === 0 ? step : match(trial, i, step)));

  const match = (trial, i, step) => {
    const by = choice.value || "time";
    const [first] = trials;
    const clamp = (value) => Math.max(0, Math.min(trial.meta.n_steps - 1, Math.round(value)));
    if (by === "distance") {
      const left = tables[0].at(rowOf(first, step));
      return clamp(trial.arrays.step[tables[i].firstWithin(left)]);
    }
    const origin = (own) => originOf(own, by);
    return clamp(origin(trial) + ((step - origin(first)) * first.meta.control_dt_s) / trial.meta.control_dt_s);
  };

  const follow = (step) => {
    const steps = aligned(step);
    steps.forEach((own, i) => page.views.seek(i, own, rowOf(trials[i], own)));
    byId("views").dataset.steps = steps.join(",");
  };

  const stop = () => {
    if (!on) return;
    const { id } = trials[0].meta;
    leave();
    page.open(id);
  };

  const leave = () => {
    on = false;
    run += 1;
    bar.hidden = true;
    delete document.body.dataset.comparing;
  };

  choice.addEventListener("change", draw);
  button.addEventListener("click", start);
  page.list.addEventListener("compare", update);
  update();
  return {
    get on() { return on; },
    follow,
    leave,
    /** Where on the plots' axis a step of the first trial lies. */
    position(step) {
      const [first] = trials;
      if (choice.value === "distance") return -tables[0].at(rowOf(first, step));
      return (step - originOf(first, choice.value)) * first.meta.control_dt_s;
    },
    /** The reverse. */
    stepAt(x) {
      const [first] = trials;
      if (choice.value === "distance") return first.arrays.step[tables[0].firstWithin(-x)];
      return originOf(first, choice.value) + Math.round(x / first.meta.control_dt_s);
    },
  };
}

/** Events that all trials have, in the first one's order. */
function shared(trials) {
  const labels = trials.map(({ meta }) => new Set(meta.marks.filter(({ kind }) => kind !== "start").map(({ label }) => label)));
  return [...labels[0]].filter((label) => labels.every((own) => own.has(label)));
}
