/** The dialog that maps and calibrates a gamepad. */

import { byId, h, icon, setText } from "./dom.js";
import { shortName } from "./gamepad.js";
import { AXES, BUTTONS, loadProfile, resetProfile, saveProfile } from "./pad-profiles.js";

const AXIS_TITLES = {
  leftX: "Left stick, right", leftY: "Left stick, up", rightX: "Right stick, right", rightY: "Right stick, up",
};
const BUTTON_TITLES = { grasp: "Grasp", rotate: "Move or rotate", assist: "Assistance", next: "New trial" };
const MOVED = 0.6; // how far an axis moves before it is taken for the one meant

/** @param {ReturnType<import("./gamepad.js").watchGamepads>} gamepads */
export function createPadSheet(gamepads) {
  const dialog = /** @type {HTMLDialogElement} */ (byId("pads"));
  const hint = h("p", { class: "hint", role: "status" });
  const body = h("div", { class: "pad-body" });
  let shown = "";
  let chosen = -1;
  /** @type {null | ((pad: Gamepad) => boolean)} what is waited for; true: it came */
  let waiting = null;

  dialog.append(
    h("header", {}, h("h2", { id: "pads-title" }, "Input devices"),
      h("button", { class: "icon", type: "button", "aria-label": "Close", on: { click: () => dialog.close() } }, icon("close"))),
    h("p", {}, "The sticks on the screen, the keyboard and gamepads work side by side; the one pushed last steers."),
    body, hint,
  );
  dialog.addEventListener("close", () => {
    waiting = null;
    gamepads.pause(false);
  });

  const current = () => gamepads.list().find((pad) => pad.index === chosen) ?? gamepads.list()[0];
  const save = (pad, change) => {
    const profile = loadProfile(pad);
    change(profile);
    saveProfile(pad, profile);
    gamepads.forget(pad);
    shown = "";
  };
  const wait = (text, test) => {
    setText(hint, text);
    waiting = test;
  };
  const done = (text) => {
    waiting = null;
    setText(hint, text);
    return true;
  };

  const mapAxis = (name) => {
    const rest = current().axes.slice();
    wait(`Push: ${AXIS_TITLES[name].toLowerCase()}.`, (pad) => {
      const index = pad.axes.findIndex((value, i) => Math.abs(value - rest[i]) > MOVED);
      if (index < 0) return false;
      const sign = pad.axes[index] > rest[index] ? 1 : -1;
      save(pad, ({ axes }) => Object.assign(axes[name], { index, sign }));
      return done(`${AXIS_TITLES[name]} is axis ${index}.`);
    });
  };

  const mapButton = (name) => {
    const before = current().buttons.map((button) => button.pressed);
    wait(`Press the button for: ${BUTTON_TITLES[name].toLowerCase()}.`, (pad) => {
      const index = pad.buttons.findIndex((button, i) => button.pressed && !before[i]);
      pad.buttons.forEach((button, i) => (before[i] &&= button.pressed));
      if (index < 0) return false;
      save(pad, ({ buttons }) => {
        for (const other of BUTTONS) buttons[other] = buttons[other].filter((i) => i !== index);
        buttons[name] = [index];
      });
      return done(`${BUTTON_TITLES[name]} is button ${index}.`);
    });
  };

  const calibrate = () => {
    const pad = current();
    const centre = pad.axes.slice();
    const low = centre.slice();
    const high = centre.slice();
    const finish = () => {
      save(current(), ({ axes }) => {
        for (const name of AXES) {
          const { index } = axes[name];
          // A stick that was not moved keeps the range it had.
          if (high[index] - low[index] > MOVED) Object.assign(axes[name], { low: low[index], centre: centre[index], high: high[index] });
        }
      });
      done("Calibrated.");
    };
    wait("Let go, then turn both sticks along their edges. Press Done.", (now) => {
      now.axes.forEach((value, i) => {
        low[i] = Math.min(low[i], value);
        high[i] = Math.max(high[i], value);
      });
      return false;
    });
    hint.append(" ", h("button", { class: "btn line", type: "button", on: { click: finish } }, "Done"));
  };

  const build = (pad) => {
    const profile = loadProfile(pad);
    const row = (title, value, act) =>
      h("tr", {}, h("th", { scope: "row" }, title), h("td", { class: "num" }, value),
        h("td", {}, h("button", { class: "btn line", type: "button", "aria-label": `Change: ${title}`, on: { click: act } }, "Change")));
    const dead = h("output", { class: "num" }, profile.deadZone.toFixed(2));
    return [
      h("div", { class: "seg", role: "group", "aria-label": "Gamepad" }, ...gamepads.list().map((one) =>
        h("button", { type: "button", "aria-pressed": String(one.index === pad.index), on: { click: () => (chosen = one.index) } }, shortName(one.id)))),
      h("table", {}, ...AXES.map((name) => {
        const { index, sign } = profile.axes[name];
        return row(AXIS_TITLES[name], `axis ${index}${sign < 0 ? ", reversed" : ""}`, () => mapAxis(name));
      }), ...BUTTONS.map((name) => row(BUTTON_TITLES[name], `button ${profile.buttons[name].join(", ") || "–"}`, () => mapButton(name)))),
      h("label", { class: "field" }, h("span", {}, "Dead zone"), dead,
        h("input", { type: "range", min: 0, max: 0.4, step: 0.01, value: profile.deadZone, on: {
          input: (event) => setText(dead, Number(event.target.value).toFixed(2)),
          change: (event) => save(pad, (p) => (p.deadZone = Number(event.target.value))),
        } })),
      h("div", { class: "row" },
        h("button", { class: "btn line", type: "button", on: { click: calibrate } }, "Calibrate"),
        h("button", { class: "btn line", type: "button", on: { click: () => { resetProfile(pad); gamepads.forget(pad); shown = ""; } } }, "Standard layout")),
    ];
  };

  const refresh = () => {
    if (!dialog.open) return;
    requestAnimationFrame(refresh);
    const pad = current();
    const state = pad ? `${gamepads.list().map((one) => one.index + one.id).join()}|${pad.index}` : "none";
    if (state !== shown) {
      shown = state;
      const focused = document.activeElement?.getAttribute("aria-label");
      body.replaceChildren(...(pad ? build(pad) : [h("p", { class: "hint" }, "No gamepad yet. Plug one in and press any of its buttons.")]));
      if (focused) /** @type {HTMLElement|null} */ (body.querySelector(`[aria-label="${CSS.escape(focused)}"]`))?.focus();
    }
    if (pad && waiting?.(pad)) waiting = null;
  };

  return {
    open() {
      if (dialog.open) return;
      shown = "";
      setText(hint, "");
      gamepads.pause(true);
      dialog.showModal();
      refresh();
    },
  };
}
