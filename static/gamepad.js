/**
 * Gamepads, polled here in the person's browser: any number of them, plugged in at any time, each with
 * its own remembered mapping. The browser's list has gaps (null) where pads went.
 */

import { BUTTONS, isKnown, loadProfile, readAxes } from "./pad-profiles.js";

const POLL_AT_REST = 4; // looks a second for pads where none was seen [Hz]

/**
 * @param {import("./store.js").Store} store
 * @param {import("./input.js").Input} input
 * @param {import("./actions.js").Actions} actions
 * @param {(level: string, text: string) => void} say
 */
export function watchGamepads(store, input, actions, say) {
  /** @type {Map<number, {id: string, profile: import("./pad-profiles.js").Profile, pressed: boolean[], armed: boolean}>} */
  const pads = new Map();
  let lookedAt = 0;
  let paused = false;

  const acts = {
    grasp: () => actions.graspOrNext(),
    rotate: () => actions.toggleMode(),
    assist: () => actions.toggleAssist(),
    next: () => actions.newTrial(),
  };

  const list = () => {
    try {
      return [...(navigator.getGamepads?.() ?? [])].filter((pad) => pad?.connected);
    } catch {
      return []; // a page's permissions may forbid gamepads
    }
  };

  const meet = (pad) => {
    const profile = loadProfile(pad);
    // A browser shows a pad once it is used: what it is pushed to then is meant.
    pads.set(pad.index, { id: pad.id, profile, pressed: [], armed: true });
    say("info", `Gamepad connected: ${shortName(pad.id)}`);
    if (pad.mapping !== "standard" && !isKnown(pad)) {
      say("warn", "This gamepad has no standard layout. Set it up under the device name, top right.");
    }
  };

  const read = (pad) => {
    let known = pads.get(pad.index);
    if (known?.id !== pad.id) {
      meet(pad);
      known = pads.get(pad.index);
    }
    const { profile } = known;
    const axes = readAxes(pad, profile);
    // After a blur a pad counts once it was at rest.
    known.armed ||= isAtRest(pad, profile);
    input.set(`gamepad:${pad.index}`, "gamepad", shortName(pad.id), known.armed && !paused ? axes : [0, 0, 0, 0], profile.deadZone);
    for (const name of BUTTONS) {
      for (const index of profile.buttons[name]) {
        const now = pad.buttons[index]?.pressed === true;
        if (now && known.pressed[index] === false && !paused) acts[name]();
      }
    }
    known.pressed = pad.buttons.map((button) => button.pressed === true);
  };

  const poll = (time) => {
    requestAnimationFrame(poll);
    if (document.hidden || (pads.size === 0 && time - lookedAt < 1000 / POLL_AT_REST)) return;
    lookedAt = time;
    const present = list();
    for (const pad of present) read(pad);
    for (const [index, { id }] of pads) {
      if (present.some((pad) => pad.index === index)) continue;
      pads.delete(index);
      input.remove(`gamepad:${index}`);
      say("warn", `Gamepad gone: ${shortName(id)}`);
    }
  };
  addEventListener("gamepadconnected", () => (lookedAt = -Infinity));
  input.releases.push((inViewer) => {
    if (!inViewer) for (const pad of pads.values()) pad.armed = false;
  });
  requestAnimationFrame(poll);

  return {
    list,
    /** While a pad is being set up its buttons and sticks do not reach the robot. */
    pause: (on) => (paused = on),
    forget: (pad) => pads.has(pad.index) && (pads.get(pad.index).profile = loadProfile(pad)),
  };
}

function isAtRest(pad, profile) {
  const axes = readAxes(pad, profile);
  return Math.hypot(axes[0], axes[1]) <= profile.deadZone && Math.hypot(axes[2], axes[3]) <= profile.deadZone;
}

/** "Xbox Wireless Controller (STANDARD GAMEPAD Vendor: …)" → "Xbox Wireless Controller" */
export function shortName(id) {
  return id.replace(/\s*\(.*$/, "").replace(/^[0-9a-f]{4}-[0-9a-f]{4}-/i, "").trim().slice(0, 40) || "Gamepad";
}
