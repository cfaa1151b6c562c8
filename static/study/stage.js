/**
 * The trials: the live page's sticks, keys, gamepads, socket and picture, without anything that names
 * or changes a method. The server says which trial is due; the page counts down and gives the start
 * signal once the trial stands ready in front of a person who sees it.
 */

import { hand } from "../actions.js";
import { describeOutcome } from "../banners.js";
import { byId, h, icon, setAttribute, setHidden, setText } from "../dom.js";
import { watchGamepads } from "../gamepad.js";
import { Input } from "../input.js";
import { listenToKeys } from "../keyboard.js";
import { createPadSheet } from "../pad-sheet.js";
import { Socket } from "../socket.js";
import { createSticks } from "../sticks.js";
import { initialState, Store } from "../store.js";
import { clickWithAnyFinger } from "../touch.js";
import { Viewer } from "../viewer.js";
import { watchFrames } from "./frames.js";
import { createTask } from "./task.js";

const PICTURE_PATIENCE = 12_000; // a trial starts without a picture only where none can be had [ms]

/**
 * @param {{changed: () => void, leaveFree: () => void, rotation: boolean}} page
 */
export function createStage(page) {
  const store = new Store(initialState());
  const viewer = new Viewer(document.querySelector("iframe.viewer"));
  const say = byId("say");
  const card = createCard(say);
  /** @type {any} */
  let due = null;
  /** @type {any} what was due when the trial that is shown began */
  let ending = null;
  /** @type {Socket|null} */
  let socket = null;
  let session = "";
  let hellos = 0;
  let preparedAt = 0;
  let goAt = 0;
  let startedLog = 0;
  let paused = false;
  let refusal = ""; // why there is no robot just now
  let active = false;

  const line = { get open() { return socket?.open ?? false; }, sendInput: (fields) => socket?.sendInput(fields), sendEvent: (name) => socket?.sendEvent(name) };
  const input = new Input(store, /** @type {any} */ (line));
  const actions = {
    grasp() {
      if (due?.part !== "free" && hand(store.state).canGrasp && store.state.status?.trial.phase === "running") socket?.command("grasp");
    },
    graspOrNext() {
      if (waiting()) start();
      else actions.grasp();
    },
    toggleMode: () => page.rotation && store.update({ mode: store.state.mode === "translate" ? "rotate" : "translate" }),
    newTrial() {}, method() {}, methodNumber() {}, toggleAssist() {}, settings() {}, layers() {}, camera() {}, help() {},
  };
  const gamepads = watchGamepads(store, input, actions, () => {});
  const pads = createPadSheet(gamepads);
  const task = createTask(store);
  const sticks = createSticks(store, input);
  listenToKeys(store, input, actions, () => viewer.window);
  clickWithAnyFinger();
  watchFrames((name) => socket?.sendEvent(name));
  document.addEventListener("fullscreenchange", () => socket?.sendEvent(document.fullscreenElement ? "fullscreen" : "windowed"));
  byId("grasp").addEventListener("click", actions.grasp);
  byId("rotate").addEventListener("click", actions.toggleMode);
  setHidden(byId("rotate-column"), !page.rotation);
  const enough = h("button", { class: "btn primary", type: "button", "data-testid": "continue", on: { click: () => page.leaveFree() } }, "I have tried enough");
  const pause = h("button", { class: "btn line", type: "button", on: { click: () => { paused = !paused; goAt = 0; } } }, "Wait");
  const go = h("button", { class: "btn primary", type: "button", "data-testid": "continue", on: { click: () => start() } }, "Start");
  const again = h("button", { class: "btn primary", type: "button", on: { click: () => location.reload() } }, "Try now");

  function connect() {
    if (socket) retire(socket);
    socket = null;
    hellos = 0;
    preparedAt = performance.now();
    const connection = { ...initialState().connection, rtt: store.state.connection.rtt };
    store.update({ hello: null, status: null, connection });
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    /** @type {Socket|null} while it is made it speaks already */
    let own = null;
    own = new Socket(`${scheme}://${location.host}/input/${encodeURIComponent(session)}`, {
      message: (message) => own === socket && receive(message),
      change: (changes) => (own === socket || socket === null) && store.update({ connection: { ...store.state.connection, ...changes } }),
      lost: () => {},
    });
    socket = own;
  }

  function receive(message) {
    if (message.type === "status") store.update({ status: message });
    else if (message.type === "hello") {
      refusal = "";
      store.update({ hello: message });
      if (hellos++ === 0) viewer.path = ""; // another robot behind the same path: draw it anew
      viewer.open(message.view);
      input.greet();
    } else if (message.type === "ended") {
      if (hellos === 0) refusal = message.reason;
      page.changed();
    } else if (message.type === "study") page.changed();
  }

  const trial = () => store.state.status?.trial;
  const waiting = () => active && due !== null && due.log > 0 && trial()?.number === due.log && trial().phase === "ready" && store.state.hello?.control === true && startedLog !== due.log;

  function start() {
    if (!waiting()) return;
    startedLog = due.log;
    paused = false;
    goAt = 0;
    socket?.command("start");
  }

  function render() {
    requestAnimationFrame(render);
    if (!active) return;
    const yaw = viewer.yaw();
    if (yaw !== null && yaw !== store.state.yaw) store.update({ yaw, viewYaw: yaw });
    setAttribute(byId("compass"), "data-yaw", store.state.yaw);
    task.render(due, refusal !== "" && !store.state.hello);
    sticks.render();
    setHidden(byId("grasp-column"), due?.part === "free");
    setAttribute(byId("grasp"), "aria-disabled", trial()?.phase !== "running" || store.state.hello?.control !== true);
    card.show(...content());
  }

  /** What the card in the middle says now: severity, title, line, buttons. */
  function content() {
    const { connection, hello } = store.state;
    if (refusal && !hello) return ["info", "Please wait a moment", `${sentence(refusal)} This page goes on by itself.`, []];
    if (connection.state === "lost") return ["warn", "The robot is not there just now", connection.reason || "This page tries again by itself.", [again]];
    if (connection.state !== "connected") return connection.before ? ["warn", "Connection lost.", "This trial will be repeated.", []] : ["info", "Getting the robot ready …", "", []];
    if (hello?.control === false) return ["info", "This study is open in another tab", "Please go on there. This tab takes over when the other one is closed.", []];
    const now = trial();
    if (!now || !due) return ["info", "Getting the robot ready …", "", []];
    if (due.log === now.number) ending = due;
    if (now.outcome !== "running") {
      const [severity, words] = describeOutcome({ ...now, grasped: now.grasped ?? "" });
      return [severity, words, now.outcome === "grasped" ? "Well done." : ending?.last ? "It goes on with the next one." : "This trial will be repeated.", []];
    }
    if (waiting()) return countdown();
    if (now.phase === "ready") return ["info", "Getting the robot ready …", "", []];
    if (due.part === "free" && now.phase === "running") return ["bar", "", "", [enough]];
    return ["none", "", "", []];
  }

  function countdown() {
    const seen = viewer.ready || performance.now() - preparedAt > PICTURE_PATIENCE;
    const name = due.part === "free" ? "Try the sticks" : `Grasp the ${due.target.replaceAll(/[-_]+/g, " ")}`;
    const why = due.again && due.again !== "grasped" ? (due.again === "interrupted" ? "The trial was interrupted and is repeated. " : "Once more. ") : "";
    if (paused || document.hidden || !seen) {
      goAt = 0;
      return ["info", name, seen ? `${why}Start when you are ready.` : "The picture is being drawn …", seen ? [go] : []];
    }
    const now = performance.now();
    goAt ||= now + due.countdown_s * 1000;
    if (now >= goAt) start();
    const left = Math.max(1, Math.ceil((goAt - now) / 1000));
    return ["info", name, `${why}${due.label}: it starts in ${left} …`, [pause, go]];
  }

  requestAnimationFrame(render);
  return {
    pads: pads.open,
    /** @param {any} trial the trial that is due */
    show(trial) {
      active = true;
      due = trial;
      if (!socket || socket.ended || session !== trial.session) {
        session = trial.session;
        connect();
      }
    },
    hide() {
      active = false;
      due = null;
      if (socket) retire(socket);
      socket = null;
      viewer.path = "";
      viewer.frame.removeAttribute("src");
      document.body.dataset.connection = "connected";
    },
    /** How long the outcome of the last trial should still be read [ms]. */
    get outcomeShown() {
      return active && trial() !== undefined && trial().outcome !== "running";
    },
    get ended() {
      return socket === null || socket.ended;
    },
    get connected() {
      return store.state.connection.state === "connected";
    },
  };
}

function sentence(text) {
  return `${text.charAt(0).toUpperCase()}${text.slice(1).replace(/[.\s]*$/, "")}.`;
}

/** Close a line for good; it must not come back by itself. */
function retire(socket) {
  socket.ended = true;
  clearTimeout(socket.timer);
  if (socket.socket) socket.socket.onclose = null;
  socket.socket?.close();
}

/** The card in the middle: touched only where it changes. */
function createCard(host) {
  const title = h("b");
  const words = h("span");
  const buttons = h("div", { class: "buttons" });
  const glyph = h("span", { class: "glyph" });
  const element = h("div", { class: "card panel", role: "status" }, glyph, h("div", {}, title, words), buttons);
  host.append(element);
  let shown = "";
  return {
    show(severity, heading, text, controls) {
      const now = `${severity}|${heading}|${controls.length}|${controls[0]?.textContent ?? ""}`;
      setText(words, text);
      if (now === shown) return;
      shown = now;
      element.className = `card panel ${severity}`;
      setHidden(element, severity === "none");
      setText(title, heading);
      glyph.replaceChildren(icon({ ok: "check", warn: "warn", bad: "cross" }[severity] ?? "info"));
      buttons.replaceChildren(...controls);
    },
  };
}
