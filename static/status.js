/** Top right: device, loop, link. */

import { setAttribute, setHidden, setIcon, setText } from "./dom.js";

const ICONS = { pointer: "pointer", keyboard: "keyboard", gamepad: "gamepad" };
const LATE_SHOWN = 1500; // how long the page says that the loop was late [ms]

/** @param {import("./store.js").Store} store */
export function createStatus(store) {
  const find = (selector) => document.querySelector(`.status ${selector}`);
  const device = find(".dev");
  const [hz, late, word, rtt] = [".hz", ".late", ".word", ".rtt"].map(find);
  const link = find("[data-testid=connection]");
  let lateTicks = 0;
  let lateAt = -Infinity;

  return {
    render() {
      const { connection, device: current, status, hello } = store.state;
      const connected = connection.state === "connected";
      setAttribute(device, "data-device", current.kind);
      setIcon(device.firstElementChild, ICONS[current.kind]);
      setText(device.lastElementChild, hello?.control === false ? "Watching" : status?.trial.simulated ? "Simulated user" : current.name);
      setAttribute(device, "aria-label", `Input: ${current.name}. Set up devices`);

      setAttribute(link, "data-state", connection.state);
      document.body.dataset.connection = connection.state;
      setText(word, connected ? "Connected" : connection.state === "lost" ? "Lost" : connection.before ? "Reconnecting" : "Connecting");
      setText(rtt, connected && connection.rtt !== null ? String(Math.round(connection.rtt)) : "–");

      const loop = connected ? status?.loop : undefined;
      setText(hz, loop ? String(Math.round(loop.hz)) : "–");
      if (loop && loop.late !== lateTicks) {
        if (loop.late > lateTicks) lateAt = performance.now();
        lateTicks = loop.late;
      }
      setHidden(late, !loop || performance.now() - lateAt > LATE_SHOWN);
      if (loop) setAttribute(late, "title", `${loop.late} ticks were late, the last by ${Number(loop.lateness_ms).toFixed(1)} ms`);
    },
  };
}
