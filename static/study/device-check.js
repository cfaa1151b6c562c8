/** What this browser can do: measured, shown in words, sent along as answers. */

import { h, icon, setText } from "../dom.js";

const FRAMES_FOR = 1200; // [ms]
const PINGS = 6;

/**
 * @param {any} wanted the study's limits
 * @param {string} input the device the study wants, or "any"
 * @param {() => void} changed
 */
export function createDeviceCheck(wanted, input, changed) {
  const required = new Set([...wanted.required, ...(input === "gamepad" ? ["gamepad"] : [])]);
  /** @type {Record<string, any>} */
  const found = {};
  const rows = new Map([
    ["webgl", ["3-D picture", "Looking …"]], ["screen", ["Window", "Looking …"]], ["frame_rate", ["Smoothness", "Measuring …"]],
    ["round_trip", ["Line to the robot", "Measuring …"]], ["gamepad", ["Gamepad", "None found. The sticks on the screen and the keyboard work as well."]],
  ].map(([name, [title, text]]) => {
    const state = h("span", { class: "state" }, icon("info"));
    const words = h("span", {}, text);
    return [name, { state, words, element: h("li", { dataset: { check: name } }, state, h("b", {}, title), words), level: "info" }];
  }));
  const element = h("ul", { class: "checks" }, ...[...rows.values()].map((row) => row.element));
  let running = true;

  const say = (name, fine, text) => {
    const row = rows.get(name);
    row.level = fine === null ? "info" : fine ? "ok" : required.has(name) ? "bad" : "warn";
    row.element.dataset.level = row.level;
    row.state.replaceChildren(icon({ ok: "check", warn: "warn", bad: "cross", info: "info" }[row.level]));
    setText(row.words, text);
    changed();
  };

  const webgl = () => {
    const context = document.createElement("canvas").getContext("webgl2") ?? document.createElement("canvas").getContext("webgl");
    found.webgl = context ? "yes" : "no";
    say("webgl", Boolean(context), context ? "Works." : "Your browser draws no 3-D pictures. Please turn on hardware acceleration in its settings, or try Chrome, Edge or Firefox.");
  };
  const screen = () => {
    Object.assign(found, { width_px: innerWidth, height_px: innerHeight, pixel_ratio: devicePixelRatio || 1 });
    const wide = innerWidth >= wanted.min_width_px;
    say("screen", wide, wide ? `${innerWidth} × ${innerHeight} pixels.` : "This window is narrow. Please make it wider, or turn the phone sideways.");
  };
  const frames = () => {
    let count = 0;
    const from = performance.now();
    const step = () => {
      count += 1;
      const passed = performance.now() - from;
      if (passed < FRAMES_FOR) return void requestAnimationFrame(step);
      found.frame_rate_hz = (count - 1) / passed * 1000;
      const fine = found.frame_rate_hz >= wanted.min_frame_rate_hz;
      say("frame_rate", fine, `${Math.round(found.frame_rate_hz)} pictures a second.${fine ? "" : " Other programs or tabs may slow this down; please close what you do not need."}`);
    };
    requestAnimationFrame(step);
  };
  const trips = async () => {
    const times = [];
    for (let i = 0; i < PINGS; i++) {
      const from = performance.now();
      try {
        await fetch("/api/health", { cache: "no-store" });
        times.push(performance.now() - from);
      } catch {
        await new Promise((done) => setTimeout(done, 300));
      }
    }
    found.round_trip_ms = times.sort((a, b) => a - b)[times.length >> 1] ?? 1e6;
    const fine = found.round_trip_ms <= wanted.max_round_trip_ms;
    say("round_trip", fine, fine ? `${Math.round(found.round_trip_ms)} ms there and back.` : "The line is slow. A cable, or being nearer to the router, may help.");
  };
  const pads = () => {
    if (!running) return;
    requestAnimationFrame(pads);
    const list = [...(navigator.getGamepads?.() ?? [])].filter((pad) => pad?.connected);
    const moved = list.some((pad) => pad.axes.some((value) => Math.abs(value) > 0.6) || pad.buttons.some((button) => button.pressed));
    if (found.gamepad === "yes") return;
    if (moved) {
      Object.assign(found, { gamepad: "yes", input: "gamepad" });
      say("gamepad", true, "Found, and it moves.");
    } else if (list.length && found.gamepad !== "found") {
      found.gamepad = "found";
      say("gamepad", required.has("gamepad") ? false : null, "Found. Please move its sticks once.");
    } else if (!list.length && required.has("gamepad") && rows.get("gamepad").level === "info") {
      say("gamepad", false, "None found. Please plug one in and press any of its buttons.");
    }
  };

  webgl();
  screen();
  frames();
  trips();
  pads();
  addEventListener("resize", screen);

  return {
    element,
    /** Whether everything is measured and nothing that is required falls short. */
    ready: () => "frame_rate_hz" in found && "round_trip_ms" in found && ![...rows.values()].some((row) => row.level === "bad"),
    values: () => ({
      ...found,
      gamepad: found.gamepad === "yes" ? "yes" : "no",
      input: found.input ?? "pointer",
      touch: matchMedia("(pointer: coarse)").matches ? "yes" : "no",
      browser: navigator.userAgent.slice(0, 400),
    }),
    stop() {
      running = false;
      removeEventListener("resize", screen);
    },
  };
}
