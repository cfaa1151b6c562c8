/** The pages between the trials: one builder a step. Text of the study only ever becomes text. */

import { h, icon, setAttribute, setText } from "../dom.js";
import { requestNumber } from "./api.js";
import { createDeviceCheck } from "./device-check.js";
import { createForm } from "./form.js";
import { sketch } from "./sketches.js";

/**
 * @typedef {object} Page
 * @property {Node[]} content
 * @property {() => void} [leave]
 */

/**
 * @param {any} state
 * @param {{want: (wish: Record<string, unknown>) => Promise<any>}} act
 * @returns {Page}
 */
export function buildPage(state, act) {
  const builder = BUILDERS[state.step] ?? BUILDERS.waiting;
  return builder(state, act);
}

const BUILDERS = {
  consent(state, act) {
    if (state.code) return codePage(act);
    const { consent } = state;
    const agree = h("input", { type: "checkbox", id: "agree", "data-testid": "consent-agree", on: { change: () => next.allow(agree.checked) } });
    const next = button("Continue", () => act.want({ do: "consent", request: requestNumber(), agree: true }), "Please tick the box above if you want to take part.");
    next.allow(false);
    return page(consent.title, "",
      ...consent.paragraphs.map((text) => h("p", {}, text)),
      h("h2", {}, "Which data are kept"), h("ul", {}, ...consent.kept.map((text) => h("li", {}, text))), h("p", {}, consent.retention),
      h("h2", {}, "How to withdraw"), h("p", {}, consent.withdrawal),
      h("h2", {}, "Whom to ask"), h("p", {}, consent.contact),
      h("label", { class: "agree" }, agree, h("span", {}, consent.agree)),
      footer(null, next));
  },
  background: (state, act) => formPage(state, act),
  survey: (state, act) => formPage(state, act),
  device(state, act) {
    const next = button("Continue", () => act.want({ do: "answer", at: state.at, page: "device", values: check.values() }), "Please see to what is marked above first.");
    /** @type {ReturnType<typeof createDeviceCheck>|null} */
    let check = null;
    check = createDeviceCheck(state.device, state.input, () => next.allow(check?.ready() ?? false));
    next.allow(check.ready());
    const full = document.fullscreenEnabled ? h("button", { class: "btn line", type: "button", on: { click: () => document.documentElement.requestFullscreen().catch(() => {}) } }, "Full screen") : null;
    return { ...page("Does everything work?", "A short look at your browser, your screen and your line.", check.element, footer(full, next)), leave: check.stop };
  },
  instructions(state, act) {
    const first = state.page === "start";
    const next = button("Continue", () => act.want({ do: "continue", at: state.at, page: state.leave }));
    return page(first ? "How it works" : "Now it counts", "",
      ...state.paragraphs.flatMap((text, i) => [h("p", { class: "large" }, text), first && i === 0 ? sketch("sticks") : first && i === 1 ? sketch("target") : null].filter(Boolean)),
      first ? keys() : null, footer(null, next));
  },
  switch(state, act) {
    const [before, after] = state.labels_switch;
    return page("The control switches now", "", h("p", { class: "large" }, `You have finished all trials with ${before}. The next trials are with ${after}. The task and the objects stay the same.`),
      footer(null, button("Continue", () => act.want({ do: "continue", at: state.at, page: state.leave }))));
  },
  training(state, act) {
    const left = state.extra?.left ?? 0;
    const more = state.labels.map((label, place) => h("button", { class: "btn line", type: "button", "data-testid": `extra-${label}`, on: { click: () => act.want({ do: "extra", at: state.at, place }) } }, `Practise once more with ${label}`));
    return page("Would you like more practice?", left ? `You can have up to ${left} more practice trials, or go on.` : "That was all the practice there is.",
      left ? h("div", { class: "options" }, ...more) : null,
      footer(null, button("Continue", () => act.want({ do: "continue", at: state.at, page: state.leave }))));
  },
  debrief(state, act) {
    const back = state.back ? h("button", { class: "btn line", type: "button", on: { click: () => act.want({ do: "back", at: state.at }) } }, "Back") : null;
    return page("What this was about", "", ...state.paragraphs.map((text) => h("p", { class: "large" }, text)),
      footer(back, button("Finish", () => act.want({ do: "continue", at: state.at, page: state.leave }))));
  },
  done(state) {
    if (state.saving) return page("Saving your data …", "Please leave this page open. It goes on by itself.");
    return page("Thank you!", "Everything is saved. This is the end of the study.",
      h("div", { class: "code panel" }, h("span", { class: "dim" }, "Completion code"), h("output", { class: "num", "data-testid": "completion-code" }, state.completion)),
      state.redirect ? h("p", {}, h("a", { class: "btn primary", href: state.redirect, rel: "noreferrer" }, "Back to the recruiting site")) : null,
      h("p", {}, "If you change your mind later: with this withdrawal code all your data can be deleted on ", h("a", { href: "/withdraw" }, "this page"), "."),
      h("div", { class: "code panel" }, h("span", { class: "dim" }, "Withdrawal code"), h("output", { class: "num", "data-testid": "withdrawal-code" }, state.withdrawal)));
  },
  withdrawn(state) {
    if (state.page === "excluded") return page("Thank you for your interest", "With the answers you gave this study is not for you, or it was ended for you. You can close this page; nothing else is needed.");
    const erased = state.erased ?? [];
    return page("You have left the study", erased.length ? "This has been deleted just now:" : "All your data have been deleted.",
      erased.length ? h("ul", { "data-testid": "erased" }, ...erased.map((text) => h("li", {}, text))) : null, h("p", {}, "You can close this page. Thank you for your time."));
  },
  waiting: () => page("One moment …", "The study is being fetched."),
};

function codePage(act) {
  const field = h("input", { class: "field-text", type: "text", autocomplete: "off", autocapitalize: "off", spellcheck: "false", "aria-label": "Your code", "data-testid": "code" });
  const next = button("Continue", () => act.want({ do: "code", code: field.value.trim() }));
  field.addEventListener("keydown", (event) => event.key === "Enter" && next.click());
  return page("Welcome", "Please type the code you were given.", h("p", {}, field), footer(null, next));
}

/** The page where a withdrawal code is typed. */
export function withdrawalPage(want) {
  const field = h("input", { class: "field-text", type: "text", autocomplete: "off", spellcheck: "false", "aria-label": "Withdrawal code", "data-testid": "withdrawal-code" });
  const said = h("div", { role: "status" });
  const next = button("Delete my data", async () => {
    const { erased, error } = await want({ do: "erase", code: field.value.trim() });
    said.replaceChildren(erased
      ? h("div", {}, h("p", {}, "This has been deleted:"), h("ul", { "data-testid": "erased" }, ...erased.map((text) => h("li", {}, text))))
      : h("p", { class: "error" }, error ?? "This did not work. Please try again."));
  });
  return page("Withdraw your data", "With your withdrawal code, everything that is kept of you is deleted: recordings, answers, comments, your identifier, your lines in the tables.", h("p", {}, field), said, footer(null, next));
}

function formPage(state, act) {
  const form = createForm(state.form, state.at);
  const left = h("span", { class: "dim", role: "status" });
  const next = button("Continue", async () => {
    const missing = form.missing();
    if (missing.length) return form.complain(Object.fromEntries(missing.map((key) => [key, "is not answered"])));
    form.stop();
    const { items } = await act.want({ do: "answer", at: state.at, page: state.form.page, values: form.values() });
    if (items) form.complain(items);
  });
  const count = () => {
    const n = form.missing().length;
    setText(left, n === 0 ? "" : n === 1 ? "1 question left" : `${n} questions left`);
    setAttribute(next, "aria-disabled", n > 0);
  };
  form.onChange(count);
  count();
  const back = state.back ? h("button", { class: "btn line", type: "button", on: { click: () => { form.flush(); act.want({ do: "back", at: state.at }); } } }, "Back") : h("span");
  return { ...page(state.form.title, state.form.lead, form.element, h("div", { class: "foot" }, back, left, next)), leave: form.stop };
}

function page(title, lead, ...content) {
  return { content: [h("h1", {}, title), lead ? h("p", { class: "lead" }, lead) : null, ...content].filter(Boolean) };
}

function footer(left, right) {
  return h("div", { class: "foot" }, left ?? h("span"), right);
}

/** The one button that goes on; while it is off it says what is missing. */
function button(text, press, why = "") {
  const hint = h("span", { class: "dim why", role: "status" });
  let busy = false;
  const element = /** @type {HTMLElement & {allow: (on: boolean) => void}} */ (h("button", { class: "btn primary", type: "button", "data-testid": "continue", on: {
    click: async () => {
      if (busy) return;
      if (element.getAttribute("aria-disabled") === "true" && why) return void setText(hint, why);
      busy = true;
      try {
        await press();
      } finally {
        busy = false;
      }
    },
  } }, text));
  element.allow = (on) => {
    setAttribute(element, "aria-disabled", !on);
    if (on) setText(hint, "");
  };
  queueMicrotask(() => element.before(hint));
  return element;
}

function keys() {
  const row = (what, ...names) => h("li", {}, h("span", { class: "caps" }, ...names.map((name) => h("kbd", {}, name))), what);
  return h("details", { class: "keys" }, h("summary", {}, icon("keyboard"), "Keys and gamepad"), h("ul", {},
    row("over the table", "W", "A", "S", "D"), row("up and down", "R", "F"), row("slower", "Shift"), row("close the hand", "space"), row("A gamepad's two sticks do the same; its A button closes the hand.")));
}
