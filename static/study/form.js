/** Questions: nothing preselected, kept as they are answered, by mouse, keys and screen reader. */

import { h } from "../dom.js";
import { want } from "./api.js";

const KEEP_AFTER = 500; // after the last change answers go to the server [ms]

/**
 * @param {any} form the server's description
 * @param {number} at the step
 * @returns {{element: HTMLElement, missing: () => string[], values: () => Record<string, unknown>, complain: (items: Record<string, string>) => void, onChange: (act: () => void) => void, flush: () => void, stop: () => void}}
 */
export function createForm(form, at) {
  /** @type {Map<string, any>} */
  const values = new Map(Object.entries(form.values ?? {}));
  const items = form.sections.flatMap((section) => section.items);
  /** @type {Map<string, HTMLElement>} */
  const rows = new Map();
  let listener = () => {};
  let timer = 0;

  const send = () => {
    clearTimeout(timer);
    timer = 0;
    want({ do: "draft", at, page: form.page, values: Object.fromEntries(values) });
  };
  const set = (item, value) => {
    if (value === "" || value === null) values.delete(item.key);
    else values.set(item.key, value);
    rows.get(item.key)?.classList.remove("bad");
    clearTimeout(timer);
    timer = setTimeout(send, KEEP_AFTER);
    listener();
  };

  const element = h("div", { class: "form" }, ...form.sections.map((section) => {
    const box = h("fieldset", section.label ? { "data-testid": `survey-${section.label}` } : {},
      section.title ? h("legend", {}, section.title) : null);
    let ends = "";
    section.items.forEach((item, i) => {
      const row = build(item, values.get(item.key), (value) => set(item, value));
      rows.set(item.key, row);
      box.append(row);
      // The words at the ends stand once below statements that share them.
      const now = item.ends ? JSON.stringify(item.ends) : "";
      const next = section.items[i + 1]?.ends ? JSON.stringify(section.items[i + 1].ends) : "";
      ends = now;
      if (ends && ends !== next) box.append(endsRow(item));
    });
    return box;
  }));

  return {
    element,
    missing: () => items.filter((item) => item.required && !values.has(item.key)).map((item) => item.key),
    values: () => Object.fromEntries(values),
    complain(problems) {
      for (const [key, row] of rows) row.classList.toggle("bad", key in problems);
      const first = rows.get(Object.keys(problems).find((key) => rows.has(key)) ?? "");
      first?.scrollIntoView({ block: "center" });
      first?.querySelector("input,textarea")?.focus({ preventScroll: true });
    },
    onChange: (act) => (listener = act),
    /** Send what was not sent yet. */
    flush: () => timer && send(),
    /** It is sent another way, or no longer wanted. */
    stop: () => clearTimeout(timer),
  };
}

function build(item, value, set) {
  const id = `q-${item.key.replace("/", "-")}`;
  const question = h("p", { id }, item.text, item.required ? null : h("span", { class: "dim" }, " optional"));
  if (item.kind === "text") {
    const area = h("textarea", { "aria-labelledby": id, maxlength: item.max_length, "data-testid": item.id, on: { input: () => set(area.value) } });
    area.value = value ?? "";
    return h("div", { class: "row text" }, question, area);
  }
  if (item.kind === "number") {
    const field = h("input", { type: "number", min: item.low, max: item.high, step: "any", inputmode: "decimal", "aria-labelledby": id, "data-testid": `item-${item.id}`, on: { input: () => set(field.value === "" ? null : Number(field.value)) } });
    if (value !== undefined) field.value = String(value);
    return h("div", { class: "row" }, question, h("span", { class: "number" }, field, item.unit ? h("span", { class: "dim" }, item.unit) : null));
  }
  const options = item.kind === "choice" ? item.options : Array.from({ length: item.points }, (_, i) => ({ value: i + 1, text: String(i + 1) }));
  const group = h("div", {
    class: item.kind === "choice" ? "choices" : `scale${item.points > 11 ? " fine" : ""}`, role: "radiogroup",
    "aria-labelledby": id, "aria-required": String(item.required), "data-testid": `item-${item.id}`, style: item.points ? `--points: ${item.points}` : null,
  }, ...options.map((option) => {
    const ends = item.ends && (option.value === 1 ? item.ends[0] : option.value === item.points ? item.ends[2] : "");
    const radio = h("input", { type: "radio", name: item.key, value: option.value, on: { change: () => radio.checked && set(option.value) } });
    if (ends) radio.setAttribute("aria-label", `${option.text}, ${ends}`);
    radio.checked = option.value === value;
    return item.kind === "choice" ? h("label", {}, radio, option.text) : h("label", {}, option.text, radio);
  }));
  return h("div", { class: item.kind === "choice" ? "row choice" : "row likert" }, question, group);
}

function endsRow(item) {
  return h("div", { class: "row likert ends-row", "aria-hidden": "true" }, h("span"), h("div", { class: "ends" }, ...item.ends.filter((text, i) => text || i !== 1).map((text) => h("span", {}, text))));
}
