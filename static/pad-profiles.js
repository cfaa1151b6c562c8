/** What is remembered of each kind of pad: which axis is which, its range, and its buttons. */

import { recall, remember } from "./memory.js";

/**
 * @typedef {{index: number, sign: 1|-1, low: number, centre: number, high: number}} Axis
 * @typedef {"leftX"|"leftY"|"rightX"|"rightY"} AxisName
 * @typedef {"grasp"|"rotate"|"assist"|"next"} ButtonName
 * @typedef {object} Profile
 * @property {Record<AxisName, Axis>} axes  right and up positive
 * @property {Record<ButtonName, number[]>} buttons
 * @property {number} deadZone
 */

export const AXES = /** @type {AxisName[]} */ (["leftX", "leftY", "rightX", "rightY"]);
export const BUTTONS = /** @type {ButtonName[]} */ (["grasp", "rotate", "assist", "next"]);

/** The W3C standard layout; "up" is negative there. */
function standardProfile() {
  const axis = (index, sign) => ({ index, sign, low: -1, centre: 0, high: 1 });
  return {
    axes: { leftX: axis(0, 1), leftY: axis(1, -1), rightX: axis(2, 1), rightY: axis(3, -1) },
    buttons: { grasp: [0], rotate: [4, 5], assist: [2], next: [3, 9] },
    deadZone: 0.1,
  };
}

const key = (pad) => `pad.${pad.id}`;

/** Whether this kind of pad was set up here before. */
export const isKnown = (pad) => recall(key(pad), null) !== null;

/** @returns {Profile} */
export function loadProfile(pad) {
  const stored = recall(key(pad), null);
  return isProfile(stored) ? stored : standardProfile();
}

export function saveProfile(pad, profile) {
  remember(key(pad), profile);
}

/** Back to the standard layout. */
export function resetProfile(pad) {
  saveProfile(pad, standardProfile());
}

/**
 * Left x, left y, right x, right y in [-1, 1] through the pad's mapping and range.
 * @param {Gamepad} pad
 * @param {Profile} profile
 */
export function readAxes(pad, profile) {
  const [leftX, leftY, rightX, rightY] = AXES.map((name) => {
    const { index, sign, low, centre, high } = profile.axes[name];
    const raw = pad.axes[index] ?? centre;
    if (!Number.isFinite(raw)) return 0;
    const span = raw >= centre ? high - centre : centre - low;
    return sign * Math.max(-1, Math.min(1, (raw - centre) / Math.max(span, 0.05)));
  });
  return [...round(leftX, leftY), ...round(rightX, rightY)];
}

/** Square gates reach √2 in the corners: full deflection is 1 in every direction. */
function round(x, y) {
  const scale = 1 / Math.max(1, Math.hypot(x, y));
  return [x * scale, y * scale];
}

/** Stored text may be anything: an older page's, or edited by hand. */
function isProfile(value) {
  const number = (x) => typeof x === "number" && Number.isFinite(x);
  const axis = (a) => a && number(a.index) && (a.sign === 1 || a.sign === -1) && number(a.low) && number(a.centre) && number(a.high);
  return (
    typeof value === "object" && value !== null && number(value.deadZone) && value.deadZone >= 0 && value.deadZone < 0.9 &&
    AXES.every((name) => axis(value.axes?.[name])) &&
    BUTTONS.every((name) => Array.isArray(value.buttons?.[name]) && value.buttons[name].every(number))
  );
}
