/** The live page: builds its parts, wires them to one store, one socket, one render. */

import { createActions } from "./actions.js";
import { createAnnouncer } from "./announce.js";
import { createBanners, notify } from "./banners.js";
import { createCoach } from "./coach.js";
import { createDock } from "./dock.js";
import { byId, setAttribute } from "./dom.js";
import { createDrawer } from "./drawer.js";
import { watchGamepads } from "./gamepad.js";
import { createGoals } from "./goals.js";
import { createHelp } from "./help.js";
import { Input } from "./input.js";
import { listenToKeys } from "./keyboard.js";
import { createMenu } from "./menu.js";
import { createPadSheet } from "./pad-sheet.js";
import { trialFromQuery } from "./query.js";
import { createSideView } from "./side-view.js";
import { Socket } from "./socket.js";
import { createStatus } from "./status.js";
import { createSticks } from "./sticks.js";
import { initialState, Store } from "./store.js";
import { createTags } from "./tags.js";
import { createTheme } from "./theme.js";
import { clickWithAnyFinger } from "./touch.js";
import { createTrialCard } from "./trial.js";
import { createViewPanel } from "./view-panel.js";
import { Viewer } from "./viewer.js";

const store = new Store(initialState());
const viewer = new Viewer(document.querySelector("iframe.viewer"));
const say = (level, text) => notify(store, level, text);
const session = document.querySelector("meta[name=hindsight-session]").content;
const help = createHelp();

let asked = trialFromQuery(location.search);

const socket = new Socket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/input/${encodeURIComponent(session)}`, {
  message: receive,
  change: (changes) => store.update({ connection: { ...store.state.connection, ...changes } }),
  lost: (names) => say("warn", `The line broke before the robot confirmed: ${[...new Set(names)].join(", ")}.`),
});
const actions = createActions(store, socket, { say, help: help.open });
const input = new Input(store, socket);
const theme = createTheme(store, socket);
const gamepads = watchGamepads(store, input, actions, say);
const pads = createPadSheet(gamepads);

// The order is that of what wins when two write: each part touches its own elements only.
const parts = [
  createCoach(store),
  createTrialCard(store),
  createGoals(store),
  createStatus(store),
  theme,
  createMenu(store, { help: help.open, pads: pads.open, theme: theme.toggle, say }),
  createViewPanel(store, actions),
  createSideView(store),
  createDock(store, actions),
  createDrawer(store, actions),
  createSticks(store, input),
  createBanners(store, { newTrial: () => actions.newTrial(), retry: () => socket.connect() }),
  createAnnouncer(store),
];
const tags = createTags(store, viewer);
const compass = byId("compass");

listenToKeys(store, input, actions, () => viewer.window);
clickWithAnyFinger();
byId("help-open").addEventListener("click", help.open);
document.querySelector(".dev").addEventListener("click", pads.open);

/** @param {any} message */
function receive(message) {
  if (message.type === "status") store.update({ status: message });
  else if (message.type === "notice") say(message.level, message.text);
  else if (message.type === "error") say("error", message.text);
  else if (message.type === "hello") welcome(message);
}

/** @param {import("./types.js").Hello} hello */
function welcome(hello) {
  const before = store.state.hello;
  if (before?.run !== undefined && hello.run > before.run) say("warn", "The session had ended while this page was away. A new one has begun.");
  store.update({ hello });
  viewer.open(hello.view);
  document.body.dataset.control = hello.control ? "yes" : "no";
  input.greet();
  if (!hello.control) return;
  theme.tell();
  if (asked) actions.newTrial(asked);
  asked = null;
}

const SLOW_FRAME_MS = 60;
let stale = true;
let renderedAt = 0;
store.addEventListener("change", () => {
  stale = true;
  // Where the picture takes the frames' time, the figures follow the messages instead.
  if (performance.now() - renderedAt > SLOW_FRAME_MS) render();
});

function frame() {
  requestAnimationFrame(frame);
  look();
  tags.place();
  // The countdown and the wishes' end come with time, not with a change.
  if (stale || store.state.connection.state !== "connected" || store.wishes.size) render();
}

function render() {
  stale = false;
  renderedAt = performance.now();
  for (const part of parts) part.render();
}

/** Which way the picture looks, and with it where the sticks push. */
function look() {
  const viewYaw = viewer.yaw() ?? store.state.viewYaw;
  const yaw = store.state.follow ? viewYaw : 0;
  setAttribute(compass, "data-yaw", yaw);
  if (viewYaw === store.state.viewYaw && yaw === store.state.yaw) return;
  store.update({ viewYaw, yaw });
  // The needle shows the robot's forward (world x) as the picture's "up" sees it.
  compass.style.transform = `rotate(${viewYaw}rad)`;
}

requestAnimationFrame(frame);
