/** Flags and annotations, kept beside the log. */

import { byId, h, setAttribute } from "../dom.js";
import { ask, trialPath } from "./api.js";
import { seconds } from "./words.js";

export function createNotes(page) {
  const empty = { flag: false, text: "", moments: [], revision: 0 };
  let id = "";
  let notes = { ...empty };

  const show = () => {
    setAttribute(byId("flag"), "aria-pressed", notes.flag);
    setAttribute(byId("flag"), "aria-label", notes.flag ? "Remove the flag (F)" : "Flag this trial (F)");
    byId("notes-open").classList.toggle("has", notes.text !== "" || notes.moments.length > 0);
  };

  const save = async (changes) => {
    const { flag, text, moments, revision } = { ...notes, ...changes };
    try {
      const response = await ask(`${trialPath(id)}/notes`, { method: "PUT", body: { flag, text, moments, revision } });
      notes = await response.json();
    } catch (error) {
      page.say(/** @type {Error} */ (error).message);
      await load(id);
    }
    show();
    if (!byId("notes").hidden) build();
    page.list.note(id, notes);
  };

  const load = async (trial) => {
    id = trial;
    notes = { ...empty };
    show();
    try {
      const found = await (await ask(`${trialPath(trial)}/notes`)).json();
      if (id === trial) notes = found;
    } catch (error) {
      page.say(/** @type {Error} */ (error).message);
    }
    show();
    if (!byId("notes").hidden) build();
  };

  const build = () => {
    const text = /** @type {HTMLTextAreaElement} */ (h("textarea", { rows: 4, maxlength: 4000, "aria-label": "Note on this trial", placeholder: "What is worth remembering?" }));
    text.value = notes.text;
    text.addEventListener("change", () => save({ text: text.value }));
    const moment = /** @type {HTMLInputElement} */ (h("input", { type: "text", maxlength: 400, "aria-label": "Annotate this moment", placeholder: "At this moment …" }));
    const add = () => {
      if (moment.value.trim()) save({ moments: [...notes.moments, { step: page.player.step, text: moment.value.trim() }].sort((a, b) => a.step - b.step) });
    };
    moment.addEventListener("keydown", (event) => { if (event.key === "Enter") add(); });
    byId("notes").replaceChildren(
      h("h2", {}, "Notes"),
      text,
      h("ul", {}, ...notes.moments.map((item, i) => h("li", {},
        h("button", { type: "button", class: "num", on: { click: () => page.player.seek(item.step) } }, `${seconds(page.player.secondsOf(item.step))} s`),
        h("span", {}, item.text),
        h("button", { type: "button", class: "icon", "aria-label": `Remove: ${item.text}`, on: { click: () => save({ moments: notes.moments.filter((_, k) => k !== i) }) } }, "×")))),
      h("div", { class: "row" }, moment, h("button", { type: "button", class: "btn line small", on: { click: add } }, "Add")),
      h("p", { class: "cap" }, "Kept beside the log, never in it."),
    );
  };

  byId("flag").addEventListener("click", () => save({ flag: !notes.flag }));
  page.pops.add("notes-open", "notes", build);
  return { load, toggleFlag: () => id && save({ flag: !notes.flag }) };
}
