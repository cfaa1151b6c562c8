/** The review page: the list, the trial, and what ties its parts together. */

import { byId, h, setAttribute, setHidden, setText } from "../dom.js";
import { recall, remember } from "../memory.js";
import { ask, Refusal, trialPath, unpack } from "./api.js";
import { createCompare } from "./compare.js";
import { createHelp } from "./help.js";
import { setIcon } from "./icons.js";
import { listenToKeys } from "./keys.js";
import { createLayers } from "./layers.js";
import { isUsable, TrialList } from "./list.js";
import { createNotes } from "./notes.js";
import { Player, SPEEDS } from "./player.js";
import { Plots } from "./plots.js";
import { createPops } from "./pops.js";
import { createShare } from "./share.js";
import { ReviewSocket } from "./socket.js";
import { rowOf } from "./steps.js";
import { Timeline } from "./timeline.js";
import { Views } from "./views.js";
import { createWhatIf } from "./what-if.js";

const session = /** @type {HTMLMetaElement} */ (document.querySelector("meta[name=hindsight-session]")).content;
const socket = new ReviewSocket(session);
const list = new TrialList();
const player = new Player();
const timeline = new Timeline(player);
const views = new Views(socket, session);
const plots = new Plots(byId("signals"), player);

/** What the parts share. */
const page = {
  socket, list, player, timeline, views, plots,
  /** @type {null|{meta: any, arrays: Record<string, Float32Array>}} */
  trial: null,
  say,
  announce: (text) => setText(byId("polite"), text),
  open: openTrial,
  show,
  theme: recall("review.theme", "dark") === "light" ? "light" : "dark",
  /** Curves of a trial, or of a part of it. */
  fetchSignals,
};
plots.page = page;
page.pops = createPops();
page.layers = createLayers(page);
page.notes = createNotes(page);
page.whatIf = createWhatIf(page);
page.compare = createCompare(page);
createShare(page);
const help = createHelp();
listenToKeys(page, help);

/** Something went wrong, or is going on; said on the page and to screen readers. */
function say(text, kind = "bad") {
  const note = h("div", { class: `note panel ${kind}`, role: kind === "bad" ? "alert" : "status" }, h("span", {}, text), h("button", { type: "button", class: "icon", "aria-label": "Dismiss", on: { click: () => note.remove() } }, "×"));
  byId("messages").replaceChildren(note);
  return note;
}

async function fetchSignals(id, { first = 0, last = -1, signal, progress } = {}) {
  const range = first > 0 || last >= 0 ? `?first=${first}&last=${last}` : "";
  const response = await ask(`${trialPath(id)}/signals${range}`, { signal, progress });
  return unpack(await response.arrayBuffer());
}

/** @type {AbortController|null} */
let opening = null;

/** Show a trial; a newer wish ends an older one. */
async function openTrial(id, seconds = null) {
  const listed = list.find(id);
  if (listed && !isUsable(listed)) {
    say(listed.problem || `This trial is ${listed.outcome}: it can be opened once its log is finished.`);
    return;
  }
  opening?.abort();
  const { signal } = (opening = new AbortController());
  list.select(id);
  const note = say("Opening …", "wait");
  try {
    const trial = await fetchSignals(id, { signal, progress: (share) => setText(note.firstElementChild, `Reading the log for the first time: ${Math.round(100 * share)} %`) });
    note.remove();
    page.compare.leave();
    show(trial);
    if (seconds !== null) player.seek(player.stepOf(seconds));
    await views.open([trial]);
    follow();
  } catch (error) {
    if (/** @type {Error} */ (error).name === "AbortError") return;
    note.remove();
    say(error instanceof Refusal || error instanceof Error ? error.message : String(error));
  }
}

function show(trial) {
  page.trial = trial;
  const { meta, arrays } = trial;
  document.body.dataset.trial = meta.id;
  player.load(meta);
  for (const id of ["bar", "tools", "what-if"]) setHidden(byId(id), false);
  setHidden(byId("empty"), true);
  timeline.load(meta, arrays);
  plots.load(trial);
  page.notes.load(meta.id);
  page.whatIf.load(trial);
  document.title = `${meta.participant} trial ${meta.trial} · Review`;
  page.announce(`Trial ${meta.trial} of ${meta.participant}: ${meta.method}, ${meta.instructed_goal}.`);
}

/** Views, tags and link go where the player is. */
function follow() {
  const { trial } = page;
  if (!trial) return;
  const { step } = player;
  if (page.compare.on) page.compare.follow(step);
  else views.seek(0, step, rowOf(trial, step));
  plots.follow(step);
  page.whatIf.follow(step);
}

player.addEventListener("moved", follow);
player.addEventListener("played", () => {
  const button = byId("play");
  setIcon(button, player.playing ? "pause" : "play");
  setAttribute(button, "aria-label", player.playing ? "Pause (space)" : "Play (space)");
  setAttribute(button, "aria-pressed", player.playing);
});
byId("play").addEventListener("click", () => player.toggle());
byId("previous").addEventListener("click", () => timeline.jump(-1));
byId("next").addEventListener("click", () => timeline.jump(1));
byId("speed").append(...SPEEDS.map((speed) => h("option", { value: speed, selected: speed === 1 }, `${speed}×`)));
byId("speed").addEventListener("change", (event) => player.setSpeed(Number(/** @type {HTMLSelectElement} */ (event.target).value)));

list.addEventListener("open", (event) => {
  openTrial(/** @type {CustomEvent} */ (event).detail.id);
  document.body.classList.remove("listing");
});
byId("trials-open").addEventListener("click", () => {
  const open = document.body.classList.toggle("listing");
  setAttribute(byId("trials-open"), "aria-expanded", open);
});

socket.addEventListener("ready", async () => {
  document.body.dataset.connection = "connected";
  await socket.command("theme", { theme: page.theme });
  page.layers.tell();
  try {
    await views.restore();
    follow();
  } catch (error) {
    say(/** @type {Error} */ (error).message);
  }
});
socket.addEventListener("lost", () => { document.body.dataset.connection = "lost"; });
socket.addEventListener("say", (event) => say(/** @type {CustomEvent} */ (event).detail));
socket.addEventListener("status", () => {
  const { drawn, trial } = socket.status;
  setAttribute(byId("views"), "data-drawn", drawn[0]);
  setAttribute(byId("views"), "data-drawn-trial", trial[0]);
  page.whatIf.moment(socket.status);
});

function setTheme(theme) {
  page.theme = theme;
  document.documentElement.dataset.theme = theme;
  remember("review.theme", theme);
  setAttribute(byId("theme"), "aria-label", theme === "dark" ? "Light theme" : "Dark theme");
  if (socket.ready) socket.command("theme", { theme }).catch(() => {});
  plots.restyle();
}
byId("theme").addEventListener("click", () => setTheme(page.theme === "dark" ? "light" : "dark"));
setTheme(page.theme);

/** A link to a moment: `#trial=<id>&t=<seconds>`. */
function openLink() {
  const wish = new URLSearchParams(location.hash.slice(1));
  const id = wish.get("trial");
  const t = Number(wish.get("t") ?? NaN);
  if (!id) return;
  if (page.trial?.meta.id === id && !page.compare.on) player.seek(player.stepOf(Number.isFinite(t) ? t : 0));
  else openTrial(id, Number.isFinite(t) ? t : null);
}
addEventListener("hashchange", openLink);
openLink();
