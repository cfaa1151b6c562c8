/** What a button, a key or a gamepad can ask for: one place, so that all of them do the same. */

/**
 * @typedef {object} Actions
 * @property {() => void} grasp
 * @property {() => void} graspOrNext
 * @property {(fields?: Record<string, unknown>) => void} newTrial
 * @property {(method: string) => void} method
 * @property {(index: number) => void} methodNumber
 * @property {() => void} toggleAssist
 * @property {() => void} toggleMode
 * @property {(changes: Record<string, unknown>) => void} settings
 * @property {(changes: Record<string, unknown>) => void} layers
 * @property {(preset: string) => void} camera
 * @property {() => void} help
 */

/**
 * @param {import("./store.js").Store} store
 * @param {import("./socket.js").Socket} socket
 * @param {{say: (level: string, text: string) => void, help: () => void}} page
 * @returns {Actions}
 */
export function createActions(store, socket, page) {
  const send = async (name, fields) => {
    if (store.state.hello && !store.state.hello.control) return;
    const error = await socket.command(name, fields);
    if (error) page.say("error", error);
  };
  const actions = {
    grasp() {
      const { canGrasp, canOpen } = hand(store.state);
      if (canOpen) send("open");
      else if (canGrasp) send("grasp");
    },
    graspOrNext() {
      if (store.state.status && store.state.status.trial.outcome !== "running") actions.newTrial();
      else actions.grasp();
    },
    newTrial(fields = {}) {
      send("new-trial", fields);
    },
    method(method) {
      store.wish("method", method);
      send("method", { method });
    },
    methodNumber(index) {
      const method = store.state.hello?.methods?.[index];
      if (method) actions.method(method);
    },
    toggleAssist() {
      const enabled = !isAssisted(store);
      store.wish("enabled", enabled);
      send("assist", { enabled });
    },
    toggleMode() {
      store.update({ mode: store.state.mode === "translate" ? "rotate" : "translate" });
    },
    settings(changes) {
      for (const [name, value] of Object.entries(changes)) store.wish(`settings.${name}`, value);
      send("settings", { changes });
    },
    layers(changes) {
      for (const [name, value] of Object.entries(changes)) store.wish(`layers.${name}`, value);
      send("layers", { changes });
    },
    camera(preset) {
      store.wish("camera", preset);
      send("camera", { preset });
    },
    help: () => page.help(),
  };
  return actions;
}

/** What the grasp button does now. */
export function hand({ status }) {
  const trial = status?.trial;
  return {
    canGrasp: trial !== undefined && (trial.phase === "ready" || trial.phase === "running") && trial.outcome === "running",
    canOpen: trial !== undefined && trial.phase === "done" && Boolean(trial.grasped),
    closing: trial !== undefined && (trial.phase === "closing" || trial.phase === "lifting"),
  };
}

/** Settings as the robot has them now. */
export function settingsOf({ hello, status }) {
  return status?.settings ?? hello?.settings ?? {};
}

/** @param {import("./store.js").Store} store */
export function isAssisted(store) {
  return Boolean(store.shown("enabled", settingsOf(store.state).enabled ?? true));
}

/** @param {import("./store.js").Store} store */
export function methodOf(store) {
  const { status } = store.state;
  return store.shown("method", status?.trial.method ?? settingsOf(store.state).method ?? "");
}
