/** The trial card, and the figures that stay in the document for readers and drivers. */

import { byId, h, setAttribute, setIcon, setText } from "./dom.js";
import { describeObjects, inWords } from "./objects.js";

/** @param {import("./store.js").Store} store */
export function createTrialCard(store) {
  const card = byId("trial");
  const [title, time, input] = [".title", ".time", ".input"].map((selector) => card.querySelector(selector));
  const glyph = card.querySelector("svg");
  const readings = byId("readings");
  const hand = readings.firstElementChild;
  /** @type {Map<string, HTMLElement>} */
  const objects = new Map();

  return {
    render() {
      const { hello, status } = store.state;
      const trial = status?.trial ?? hello?.trial;
      if (!trial) return;
      const object = describeObjects(hello).find(({ name }) => name === trial.target);
      card.dataset.hue = object?.hue ?? "";
      setIcon(glyph, object?.glyph ?? "object");
      setText(title, trial.target ? `Grasp the ${inWords(trial.target)}` : "Steer the hand");
      setText(time, seconds(trial.seconds));
      setText(input, seconds(trial.input));
      setAttribute(card, "data-target", trial.target ?? "");
      setAttribute(card, "data-outcome", trial.outcome ?? "running");
      setAttribute(card, "data-seconds", Math.max(0, Number(trial.seconds) || 0));
      setAttribute(card, "data-input", Math.max(0, Number(trial.input) || 0));
      place(hand, status?.hand);
      const seen = status?.objects ?? {};
      for (const [name, position] of Object.entries(seen)) {
        if (!objects.has(name)) {
          const reading = h("data", { "data-testid": `object-${name}` });
          objects.set(name, reading);
          readings.append(reading);
        }
        place(objects.get(name), position);
      }
      for (const [name, reading] of objects) {
        if (Object.hasOwn(seen, name)) continue;
        objects.delete(name);
        reading.remove();
      }
    },
  };
}

/** Seconds with one digit; before the start signal they are zero. */
export function seconds(value) {
  return Math.max(0, Number(value) || 0).toFixed(1);
}

function place(element, position) {
  ["x", "y", "z"].forEach((axis, i) => {
    if (position) setAttribute(element, `data-${axis}`, position[i]);
    else element.removeAttribute(`data-${axis}`);
  });
}
