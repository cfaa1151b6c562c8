/** The two on-screen sticks: they show what is sent, and take it from pointers and arrow keys. */

import { byId, h, s, setAttribute, setText } from "./dom.js";

const TRAVEL = 0.3; // of the stick's width, from the centre to full deflection
const SHOWN_FROM = 0.04; // shorter vectors are left out (full stick = 1)

const WORDS = {
  translate: {
    left: { label: "Height", n: "up", s: "down", w: "", e: "" },
    right: { label: "Table plane", n: "away", s: "near", w: "left", e: "right" },
  },
  rotate: {
    left: { label: "Yaw", n: "", s: "", w: "left", e: "right" },
    right: { label: "Roll, pitch", n: "pitch +", s: "pitch −", w: "roll −", e: "roll +" },
  },
};

/**
 * @param {import("./store.js").Store} store
 * @param {import("./input.js").Input} input
 */
export function createSticks(store, input) {
  const values = { left: [0, 0], right: [0, 0] };
  const push = () => input.set("pointer", "pointer", "On-screen sticks", [...values.left, ...values.right]);
  const sticks = ["left", "right"].map((side) => {
    const stick = new Stick(side, (value) => {
      values[side] = value;
      push();
    });
    input.releases.push(() => stick.release());
    return stick;
  });
  push();
  return {
    render() {
      const { axes, mode, status, connection, hello, yaw } = store.state;
      const live = connection.state === "connected" && hello?.control === true;
      const still = !live || (status && status.trial.outcome !== "running");
      const simulated = live && status?.trial.simulated ? status.sticks : undefined;
      const turn = simulated ? simulated.yaw - yaw : 0;
      for (const stick of sticks) {
        const own = stick.side === "left" ? axes.slice(0, 2) : axes.slice(2);
        const value = simulated ? simulated[stick.side] : own;
        const assist = still ? [0, 0] : (status?.assist_stick?.[stick.side] ?? [0, 0]);
        const seen = (vector) => (stick.side === "right" ? turned(vector, turn) : vector);
        stick.render(simulated?.mode ?? mode, live ? seen(value) : [0, 0], seen(assist));
      }
    },
  };
}

/** A stick's vector that was pushed in a view of another heading, as it is in this one. */
function turned([x, y], angle) {
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  return [x * cos - y * sin, x * sin + y * cos];
}

class Stick {
  constructor(side, changed) {
    this.side = side;
    this.changed = changed;
    this.pointer = null;
    this.element = byId(`stick-${side}`);
    this.label = byId(`${side}-label`);
    this.words = Object.fromEntries(["n", "s", "w", "e"].map((d) => [d, h("span", { class: `dir ${d}`, "aria-hidden": "true" })]));
    this.knob = h("span", { class: "knob" });
    // One unit of the drawing is the knob's full travel.
    const half = 0.5 / TRAVEL;
    const drawing = s("svg", { class: "vec", viewBox: `${-half} ${-half} ${2 * half} ${2 * half}`, "aria-hidden": "true" });
    this.user = s("path", { class: "user" });
    this.assist = s("path", { class: "assist" });
    this.centre = s("circle", { class: "user", r: 0.055 });
    drawing.append(this.user, this.centre, this.assist);
    this.element.append(...Object.values(this.words), this.knob, drawing);
    this.element.addEventListener("pointerdown", (event) => this.#down(event));
    // Captured events bubble to the window; so do those of a pointer that could not be captured.
    addEventListener("pointermove", (event) => event.pointerId === this.pointer && this.#move(event));
    for (const end of ["pointerup", "pointercancel"]) {
      addEventListener(end, (event) => event.pointerId === this.pointer && this.release());
    }
    this.element.addEventListener("lostpointercapture", (event) => event.pointerId === this.pointer && this.release());
    this.element.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  #down(event) {
    if (this.pointer !== null || event.button > 0) return;
    this.pointer = event.pointerId;
    const box = this.element.getBoundingClientRect();
    this.box = { x: box.x + box.width / 2, y: box.y + box.height / 2, travel: TRAVEL * box.width };
    try {
      this.element.setPointerCapture(event.pointerId);
    } catch {
      // The pointer is gone already, or it is a script's: the window's listeners still follow it.
    }
    this.#move(event);
  }

  #move(event) {
    const x = (event.clientX - this.box.x) / this.box.travel;
    const y = (this.box.y - event.clientY) / this.box.travel;
    const scale = 1 / Math.max(1, Math.hypot(x, y));
    this.changed([x * scale, y * scale]);
  }

  release() {
    if (this.pointer === null) return;
    this.pointer = null;
    this.changed([0, 0]);
  }

  render(mode, [x, y], assist) {
    const words = WORDS[mode][this.side];
    setText(this.label, words.label);
    for (const [direction, element] of Object.entries(this.words)) setText(element, words[direction]);
    const pushed = Math.hypot(x, y) > SHOWN_FROM;
    this.element.classList.toggle("live", pushed);
    this.element.style.setProperty("--x", String(x));
    this.element.style.setProperty("--y", String(y));
    setAttribute(this.user, "d", pushed ? `M0 0L${x.toFixed(3)} ${(-y).toFixed(3)}` : "");
    setAttribute(this.centre, "visibility", pushed ? "visible" : "hidden");
    setAttribute(this.assist, "d", arrow([x, -y], [assist[0], -assist[1]]));
  }
}

/** An arrow from `start` by `vector`, short enough to stay near the stick. */
function arrow([x, y], [dx, dy]) {
  const length = Math.hypot(dx, dy);
  if (!(length > SHOWN_FROM)) return "";
  const scale = Math.min(1, 1.4 / length);
  const [tipX, tipY] = [x + dx * scale, y + dy * scale];
  const head = Math.min(0.17, 0.6 * length * scale);
  const wing = (turn) => {
    const angle = Math.atan2(dy, dx) + Math.PI + turn;
    return `${(tipX + head * Math.cos(angle)).toFixed(3)} ${(tipY + head * Math.sin(angle)).toFixed(3)}`;
  };
  return `M${x.toFixed(3)} ${y.toFixed(3)}L${tipX.toFixed(3)} ${tipY.toFixed(3)}M${wing(0.6)}L${tipX.toFixed(3)} ${tipY.toFixed(3)}L${wing(-0.6)}`;
}
