/** The participant's page: shows the step the server says, and never anything else. */

import { byId, h, setAttribute, setHidden, setText } from "../dom.js";
import { getState, want } from "./api.js";
import { buildPage, withdrawalPage } from "./pages.js";
import { createStage } from "./stage.js";

const RESULT_FOR = 1800; // an outcome is read before the next page comes [ms]
const LOOK_AFTER = 1500; // where a trial is due and nothing is heard, the server is asked again [ms]

const root = byId("step");
const paper = byId("paper");
const leave = h("button", { class: "btn", type: "button", "data-testid": "withdraw", on: { click: withdraw } }, "Leave the study");
/** @type {ReturnType<typeof createStage>|null} */
let stage = null;
/** @type {any} */
let shown = null;
let leavePage = () => {};
let asking = false;
let askAgain = false;

const act = {
  /** Do something, and show what the server says after it. */
  async want(wish) {
    const answer = await want(wish);
    if (answer.state) await show(answer.state);
    if (answer.error) complain(answer.error);
    return { ...answer, items: answer.items && Object.keys(answer.items).length ? answer.items : undefined };
  },
};

async function refresh() {
  if (asking) {
    askAgain = true;
    return;
  }
  asking = true;
  do {
    askAgain = false;
    const { state, error } = await getState();
    if (state) await show(state);
    else if (error) complain(error);
  } while (askAgain);
  asking = false;
}

async function show(state) {
  const key = JSON.stringify([state.step, state.page, state.at, state.code, state.saving, state.completion, state.extra?.left, Boolean(state.trial)]);
  const trial = state.trial && (state.step === "trial" || state.step === "training");
  if (trial) {
    showTrial(state, key);
    return;
  }
  if (shown === key) return;
  if (stage?.outcomeShown) await new Promise((done) => setTimeout(done, RESULT_FOR));
  stage?.hide();
  shown = key;
  leavePage();
  setHidden(byId("stage"), true);
  setHidden(byId("pages"), false);
  const page = buildPage(state, act);
  leavePage = page.leave ?? (() => {});
  byId("leave-page").replaceChildren(...(["done", "withdrawn"].includes(state.step) || state.at === 0 ? [] : [leave]));
  paper.replaceChildren(...page.content);
  mark(state);
  paper.parentElement.scrollTop = 0;
  paper.focus({ preventScroll: true });
  if (state.saving) setTimeout(refresh, 1000);
}

function showTrial(state, key) {
  stage ??= createStage({
    changed: refresh,
    rotation: state.rotation,
    leaveFree: () => act.want({ do: "continue", at: freeAt.at, page: freeAt.leave }),
  });
  freeAt.at = state.at;
  freeAt.leave = state.leave;
  if (shown !== key) {
    leavePage();
    leavePage = () => {};
    shown = key;
    setHidden(byId("pages"), true);
    setHidden(byId("stage"), false);
    paper.replaceChildren();
    byId("leave-stage").replaceChildren(leave);
  }
  mark(state);
  stage.show(state.trial);
}
const freeAt = { at: 0, leave: "" };

function mark(state) {
  setAttribute(root, "data-step", state.step);
  setAttribute(root, "data-page", state.page ?? "");
  setText(byId("study-title"), state.title ?? "Study");
  document.title = state.title ?? "Study";
  document.documentElement.dataset.theme = state.theme ?? "dark";
  const [now, of] = state.progress ?? [0, 0];
  const bar = byId("progress");
  setAttribute(bar, "aria-label", of ? `Part ${now + 1} of ${of}` : "");
  bar.replaceChildren(...Array.from({ length: of }, (_, i) => h("i", { class: i < now ? "d" : i === now ? "c" : "" })));
}

function complain(text) {
  let box = paper.querySelector(".error");
  if (!box) {
    box = h("p", { class: "error", role: "alert" });
    const foot = paper.querySelector(".foot");
    if (foot) foot.before(box);
    else paper.append(box);
  }
  setText(box, text);
}

async function withdraw() {
  stage?.hide();
  await act.want({ do: "withdraw" });
}

// The server may have been restarted, or the trial's process ended: ask where we are.
setInterval(() => {
  const step = root.dataset.step;
  if (stage && (step === "trial" || step === "training") && !byId("stage").hidden && (stage.ended || !stage.connected)) refresh();
}, LOOK_AFTER);
addEventListener("pageshow", (event) => event.persisted && refresh());

if (location.pathname === "/withdraw") {
  setAttribute(root, "data-step", "withdraw");
  paper.replaceChildren(...withdrawalPage(want).content);
} else {
  refresh();
}
