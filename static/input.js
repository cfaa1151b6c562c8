/**
 * Merges the devices into one input and sends it: 60 Hz while pushed, 10 Hz at rest, zero at once
 * when the page loses its user. The device pushed last wins; the others are not added.
 */

import { clock } from "./socket.js";

export const DEAD_ZONE = 0.1;
const FAST = 15; // least time between inputs while pushed: 60 Hz and a timer's jitter [ms]
const SLOW = 100; // [ms]
const REST = Object.freeze([0, 0, 0, 0]);

export class Input {
  /**
   * @param {import("./store.js").Store} store
   * @param {import("./socket.js").Socket} socket
   */
  constructor(store, socket) {
    this.store = store;
    this.socket = socket;
    /** @type {Map<string, {kind: import("./types.js").DeviceKind, name: string, axes: number[], since: number, deadZone: number}>} */
    this.sources = new Map();
    this.current = "pointer";
    this.sentAt = -Infinity;
    this.sentRest = true;
    this.away = false;
    /** Called at blur and hidden: devices let go of what they hold. */
    this.releases = [];
    addEventListener("blur", () => this.#leave("blur"));
    addEventListener("focus", () => this.#come("focus"));
    document.addEventListener("visibilitychange", () =>
      document.hidden ? this.#leave("hidden") : this.#come("visible"),
    );
    addEventListener("pagehide", () => this.#leave("hidden"));
    addEventListener("pageshow", (event) => event.persisted && this.#come("visible"));
    setInterval(() => this.#pump(), 1000 / 60);
  }

  /**
   * A device's newest reading.
   * @param {string} id one per device: "pointer", "keyboard", "gamepad:0"
   * @param {import("./types.js").DeviceKind} kind
   * @param {string} name said to the person
   * @param {number[]} axes left x, left y, right x, right y in [-1, 1]; right and up positive
   */
  set(id, kind, name, axes, deadZone = DEAD_ZONE) {
    const before = this.sources.get(id);
    const pushed = isPushed(axes, deadZone);
    const wasPushed = before !== undefined && isPushed(before.axes, before.deadZone);
    const since = pushed && !wasPushed ? performance.now() : (before?.since ?? 0);
    this.sources.set(id, { kind, name, axes, since, deadZone });
    if (pushed && this.away && document.hasFocus()) this.#come("focus");
    this.#choose();
    if (before === undefined || before.axes.some((value, i) => value !== axes[i])) this.#pump();
  }

  /** A device that was unplugged. */
  remove(id) {
    this.sources.delete(id);
    if (this.current === id) this.current = "pointer";
    this.#choose();
    this.#pump();
  }

  #choose() {
    let newest = this.sources.get(this.current);
    if (newest && !isPushed(newest.axes, newest.deadZone)) newest = undefined;
    for (const [id, source] of this.sources) {
      if (!isPushed(source.axes, source.deadZone)) continue;
      if (newest && source.since <= newest.since) continue;
      newest = source;
      this.current = id;
    }
  }

  #leave(name) {
    const inViewer = name === "blur" && document.activeElement instanceof HTMLIFrameElement && document.hasFocus();
    for (const release of this.releases) release(inViewer);
    if (inViewer) return; // a click into the picture: sticks and pads go on, its keys come by message
    this.away = true;
    for (const source of this.sources.values()) source.axes = [...REST];
    this.#pump(true);
    this.socket.sendEvent(name);
  }

  #come(name) {
    this.away = false;
    this.socket.sendEvent(name);
    this.#pump(true);
  }

  /** After a (re)connect the server knows nothing of this page: say where its user is. */
  greet() {
    if (document.hidden) this.socket.sendEvent("hidden");
    else if (this.away) this.socket.sendEvent("blur");
    this.#pump(true);
  }

  #pump(force = false) {
    const { state } = this.store;
    const source = this.sources.get(this.current);
    const axes = onlyUsed(source?.axes ?? REST, state.mode);
    const rest = axes.every((value) => value === 0);
    const kind = source?.kind ?? "pointer";
    if (axes.some((value, i) => value !== state.axes[i]) || state.device.kind !== kind || (source && state.device.name !== source.name)) {
      this.store.update({ axes, device: { kind, name: source?.name ?? "On-screen sticks" } });
    }
    if (!this.socket.open || state.hello?.control !== true) return;
    const now = performance.now();
    const justReleased = rest && !this.sentRest;
    const due = now - this.sentAt >= (rest ? SLOW : FAST);
    if (!due && !justReleased && !force) return;
    this.sentAt = now;
    this.sentRest = rest;
    this.socket.sendInput({
      t: clock(now),
      left: [axes[0], axes[1]],
      right: [axes[2], axes[3]],
      mode: state.mode,
      device: kind,
      yaw: state.yaw,
      dead_zone: source?.deadZone ?? DEAD_ZONE,
    });
  }
}

/** Drop the axes a mode does not use: they must not count as the person's effort. */
function onlyUsed([leftX, leftY, rightX, rightY], mode) {
  return mode === "translate" ? [0, leftY, rightX, rightY] : [leftX, 0, rightX, rightY];
}

function isPushed([leftX, leftY, rightX, rightY], deadZone) {
  return Math.hypot(leftX, leftY) > deadZone || Math.hypot(rightX, rightY) > deadZone;
}
