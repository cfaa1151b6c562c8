/** What other settings would have done: on the logged states, or re-simulated from a moment on. */

import { byId, h, setHidden, setText } from "../dom.js";
import { inWords } from "../objects.js";
import { ask, trialPath, unpack } from "./api.js";
import { seconds } from "./words.js";

const OFTEN = ["gain", "beta", "temperature", "w_translation", "arbitration", "arbitration_distance", "takeover", "magnitude"];

export function createWhatIf(page) {
  const panel = byId("what-if-panel");
  /** @type {AbortController|null} */
  let running = null;
  let trial = null;
  let result = null;
  let moments = new Map();
  let inputs = {};

  const build = () => {
    if (!trial || panel.dataset.trial === trial.meta.id) return;
    panel.dataset.trial = trial.meta.id;
    const { settings, methods } = trial.meta;
    const select = (name, options) => h("label", { class: "field" }, h("span", {}, inWords(name)), h("span", { class: "select" }, (inputs[name] = h("select", { dataset: { setting: name } }, ...options.map((value) => h("option", { value, selected: settings[name] === value }, inWords(value)))))));
    const extra = h("select", { "aria-label": "Another setting", dataset: { testid: "what-if-setting" } }, h("option", { value: "" }, "another setting …"), ...Object.keys(settings).filter((name) => !["method", "predictor", "prior", "enabled"].includes(name)).sort((a, b) => OFTEN.includes(b) - OFTEN.includes(a)).map((name) => h("option", { value: name }, inWords(name))));
    const extras = h("div", { class: "extras" });
    inputs = {};
    extra.addEventListener("change", () => {
      const name = extra.value;
      if (name && !inputs[name]) {
        inputs[name] = h("input", { type: "text", value: String(settings[name]), dataset: { setting: name }, spellcheck: "false" });
        extras.append(h("label", { class: "field" }, h("span", {}, inWords(name)), inputs[name]));
        inputs[name].focus();
      }
      extra.value = "";
    });
    panel.replaceChildren(
      h("header", {}, h("h2", {}, "What would have been"), h("button", { type: "button", class: "icon", "aria-label": "Close", on: { click: () => page.pops.toggle("what-if-panel") } }, "×")),
      select("method", methods),
      select("predictor", ["calibrated", "paper"]),
      extras,
      h("label", { class: "field" }, h("span", { class: "select" }, extra)),
      h("div", { class: "row" },
        h("button", { type: "button", class: "btn primary small", dataset: { testid: "what-if-open" }, on: { click: () => run("open") } }, "On these states"),
        h("button", { type: "button", class: "btn line small", dataset: { testid: "what-if-closed" }, on: { click: () => run("closed") } }, "From here on")),
      h("div", { class: "answer", dataset: { testid: "what-if-result" }, "aria-live": "polite" }),
      h("h3", {}, "Each method, at this moment"),
      h("table", { class: "methods", dataset: { testid: "what-if-moment" } }, h("thead", {}, h("tr", {}, ...["", "asks for", "adds"].map((text) => h("th", { scope: "col" }, text)))), h("tbody")),
    );
    showMoment();
  };

  /** What differs from the trial's own settings. */
  const changes = () => {
    const wanted = {};
    for (const [name, input] of Object.entries(inputs)) {
      const own = trial.meta.settings[name];
      const text = /** @type {HTMLInputElement} */ (input).value.trim();
      if (text === String(own)) continue;
      wanted[name] = typeof own === "number" || own === "inf" ? (text === "inf" ? text : Number(text.replace(",", "."))) : typeof own === "boolean" ? text === "true" : text;
      if (Number.isNaN(wanted[name])) throw new Error(`${inWords(name)} is “${text}”; valid: a number`);
    }
    return wanted;
  };

  const answer = () => panel.querySelector(".answer");

  const run = async (loop) => {
    running?.abort();
    const own = (running = new AbortController());
    try {
      const wanted = changes();
      const { step } = page.player;
      answer().replaceChildren(h("p", {}, "Computing …"), h("button", { type: "button", class: "btn line small", on: { click: () => own.abort() } }, "Cancel"));
      const progress = (share) => setText(answer().firstElementChild, `Computing … ${Math.round(100 * share)} %`);
      const body = loop === "open" ? { loop, changes: wanted } : { loop, changes: wanted, step };
      const response = await ask(`${trialPath(trial.meta.id)}/what-if`, { method: "POST", body, signal: own.signal, progress });
      result = { ...unpack(await response.arrayBuffer()), loop };
      result.name = Object.keys(wanted).length ? Object.entries(wanted).map(([name, value]) => (name === "method" ? inWords(value) : `${inWords(name)} ${inWords(value)}`)).join(", ") : "unchanged";
      page.plots.setAlternative(result);
      page.socket.command("path", { view: 0, points: result.meta.path ?? [] }).catch(() => {});
      explain();
      setHidden(byId("signals"), false);
    } catch (error) {
      if (running !== own) return;
      const text = /** @type {Error} */ (error).name === "AbortError" ? "Cancelled." : /** @type {Error} */ (error).message;
      answer().replaceChildren(h("p", { class: "bad", role: "alert" }, text));
    }
  };

  const explain = () => {
    const { meta } = result;
    const lines = [h("p", {}, h("b", {}, result.name), result.loop === "open" ? ": on the logged states, drawn with dashes." : `: re-simulated from ${seconds(page.player.secondsOf(meta.first))} s on.`)];
    if (result.loop === "closed") {
      const ended = meta.outcome === "running" ? "had not ended when the inputs did" : `ended: ${inWords(meta.outcome)}${meta.grasped_object ? ` (${inWords(meta.grasped_object)})` : ""}`;
      lines.push(h("p", {}, `It ${ended}. The log: ${inWords(trial.meta.summary?.outcome ?? "unknown")}.`), h("p", { class: "warn" }, meta.caveat));
      if (meta.parts_at !== null) lines.push(h("p", { class: "warn" }, `Before that moment it leaves the log at ${seconds(page.player.secondsOf(meta.parts_at))} s: this program or machine computes otherwise.`));
      for (const text of meta.refused.slice(0, 3)) lines.push(h("p", { class: "dim" }, `A logged command was not possible ${text}`));
    }
    answer().replaceChildren(...lines, h("p", { class: "num now", dataset: { testid: "what-if-now" } }), h("button", { type: "button", class: "btn line small", on: { click: clear } }, "Remove"));
    answer().dataset.loop = result.loop;
    follow(page.player.step);
  };

  const clear = () => {
    running?.abort();
    result = null;
    if (page.plots.alternative) page.plots.setAlternative(null);
    page.socket.command("path", { view: 0, points: [] }).catch(() => {});
    answer()?.replaceChildren();
  };

  /** The alternative in numbers, at the step shown. */
  const follow = (step) => {
    const now = panel.querySelector(".now");
    if (!result || !now || page.compare.on) return;
    const steps = result.arrays.step;
    let row = Math.min(steps.length - 1, Math.round((step / Math.max(1, steps.at(-1))) * (steps.length - 1)));
    while (row > 0 && steps[row] > step) row -= 1;
    const speed = (arrays, at) => Math.hypot(...[0, 1, 2].map((i) => arrays[`assistance.${i}`][at]));
    const other = speed(result.arrays, row);
    setText(now, `Assistance here: ${other.toFixed(3)} m/s instead of ${speed(page.plots.trial.arrays, page.plots.row).toFixed(3)} m/s.`);
    now.dataset.assistance = other.toFixed(6);
  };

  const showMoment = () => {
    const body = panel.querySelector(".methods tbody");
    if (!body) return;
    const rows = [...moments].map(([method, twist]) => {
      const direct = moments.get("direct") ?? twist;
      const size = (values) => Math.hypot(...values.slice(0, 3)).toFixed(3);
      return h("tr", { dataset: { method } }, h("th", { scope: "row" }, inWords(method)), h("td", { class: "num" }, `${size(twist)} m/s`), h("td", { class: "num" }, `${size(twist.map((v, i) => v - direct[i]))} m/s`));
    });
    body.replaceChildren(...(rows.length ? rows : [h("tr", {}, h("td", { colspan: 3, class: "dim" }, "The arm is not released at this moment."))]));
  };

  page.pops.add("what-if", "what-if-panel", build, true);
  return {
    load(next) {
      clear();
      trial = next;
      delete panel.dataset.trial;
      if (!panel.hidden) build();
    },
    follow,
    /** Out of the way of trials side by side. */
    close() {
      clear();
      if (!panel.hidden) page.pops.toggle("what-if-panel");
    },
    /** What each method asks for at the step drawn, as the worker reports it. */
    moment(status) {
      const text = JSON.stringify(status.moment);
      if (panel.hidden || panel.dataset.moment === text) return;
      panel.dataset.moment = text;
      moments = new Map(Object.entries(status.moment ?? {}));
      showMoment();
    },
  };
}
