/** A number's last 20 s as an SVG path on a fixed scale from 0 to 1. */

export const WINDOW = 20; // [s]
const STEP = 0.1; // one point per step is enough for a line of 230 pixels [s]

export class History {
  constructor() {
    /** @type {[number, number][]} time [s] and value */
    this.points = [];
  }

  clear() {
    this.points.length = 0;
  }

  /** @returns {boolean} whether the point was kept */
  add(time, value) {
    const last = this.points.at(-1);
    if (last && time - last[0] < STEP) return false;
    this.points.push([time, value]);
    while (this.points.length > 1 && this.points[1][0] < time - WINDOW) this.points.shift();
    return true;
  }

  /** From `bottom` at 0 to `top` at 1; x in seconds, `now` at the right edge. */
  path(now, top, bottom) {
    const at = ([time, value]) =>
      `${Math.max(0, time - now + WINDOW).toFixed(2)} ${(bottom - (bottom - top) * value).toFixed(2)}`;
    return this.points.length > 1 ? `M${this.points.map(at).join("L")}` : "";
  }
}
