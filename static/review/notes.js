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
    render();
  };

  let saving = Promise.resolve();

  /** One after the other: each change is made from the notes that the one before has left. */
  const save = (change) => {
    const trial = id;
    saving = saving.then(async () => {
      if (trial !== id) return;
      const { flag, text, moments, revision } = { ...notes, ...change(notes) };
      try {
        const response = await ask(`${trialPath(trial)}/notes`, { method: "PUT", body: { flag, text, moments, revision } });
        notes = await response.json();
      } catch (error) {
        page.say(/** @type {Error} */ (error).message);
        await load(trial);
      }
      show();
      page.list.note(trial, notes);
    });
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
  };

  const text = /** @type {HTMLTextAreaElement} */ (h("textarea", { rows: 4, maxlength: 4000, "aria-label": "Note on this trial", placeholder: "What is worth remembering?" }));
  const moment = /** @type {HTMLInputElement} */ (h("input", { type: "text", maxlength: 400, "aria-label": "Annotate this moment", placeholder: "At this moment …" }));
  const items = h("ul");
  const add = () => {
    const [step, words] = [page.player.step, moment.value.trim()];
    if (!words) return;
    moment.value = "";
    save(({ moments }) => ({ moments: [...moments, { step, text: words }].sort((a, b) => a.step - b.step) }));
  };
  text.addEventListener("change", () => {
    const { value } = text;
    save(() => ({ text: value }));
  });
  moment.addEventListener("keydown", (event) => { if (event.key === "Enter") add(); });
  byId("notes").append(
    h("h2", {}, "Notes"),
    text,
    items,
    h("div", { class: "row" }, moment, h("button", { type: "button", class: "btn line small", on: { click: add } }, "Add")),
    h("p", { class: "cap" }, "Kept beside the log, never in it."),
  );

  /** What somebody is writing stays as it is. */
  const render = () => {
    if (document.activeElement !== text) text.value = notes.text;
    items.replaceChildren(...notes.moments.map((item) => h("li", {},
      h("button", { type: "button", class: "num", on: { click: () => page.player.seek(item.step) } }, `${seconds(page.player.secondsOf(item.step))} s`),
      h("span", {}, item.text),
      h("button", { type: "button", class: "icon", "aria-label": `Remove: ${item.text}`, on: { click: () => save(({ moments }) => ({ moments: moments.filter(({ step, text: words }) => step !== item.step || words !== item.text) })) } }, "×"))));
  };

  const toggleFlag = () => { if (id) save(({ flag }) => ({ flag: !flag })); };
  byId("flag").addEventListener("click", toggleFlag);
  page.pops.add("notes-open", "notes", render);
  return { load, toggleFlag };
}
