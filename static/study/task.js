/** What is to be done in this trial, and the figures that stay in the document for readers and drivers. */

import { byId, h, setAttribute, setHidden, setIcon, setText } from "../dom.js";
import { describeObjects, inWords } from "../objects.js";

/** @param {import("../store.js").Store} store */
export function createTask(store) {
  const card = byId("trial");
  const glyph = card.querySelector("svg");
  const [verb, hint, label, count] = ["task-verb", "task-hint", "method-label", "trial-count"].map(byId);
  const name = card.querySelector("[data-testid=target-name]");
  const link = document.querySelector("[data-testid=connection]");
  const readings = byId("readings");
  const shown = byId("belief");
  /** @type {Map<string, HTMLElement>} */
  const objects = new Map();

  const place = (element, position) => {
    for (const [i, axis] of ["x", "y", "z"].entries()) setAttribute(element, `data-${axis}`, position[i]);
  };

  return {
    /**
     * @param {any} due the trial as the server describes it
     * @param {boolean} queued whether the page waits for a free robot
     */
    render(due, queued) {
      const { connection, hello, status } = store.state;
      const state = queued ? "reconnecting" : connection.state;
      setAttribute(link, "data-state", state);
      document.body.dataset.connection = state;
      setText(link.querySelector(".word"), queued ? "Waiting" : state === "connected" ? "Connected" : connection.before ? "Reconnecting" : "Connecting");
      if (!due) return;
      const free = due.part === "free";
      const trial = status?.trial;
      const target = free ? "" : (trial?.target ?? due.target);
      const object = describeObjects(hello).find((other) => other.name === target);
      card.dataset.hue = object?.hue ?? "";
      setIcon(glyph, free ? "pointer" : (object?.glyph ?? "object"));
      setText(verb, free ? "Try the sticks" : "Grasp the");
      setText(name, inWords(target));
      setText(hint, free ? "The robot does just what you push." : "It has a ring around it on the table.");
      setText(label, due.label);
      setText(count, free ? "" : due.of > 1 ? `${due.part === "recorded" ? "Trial" : "Practice"} ${due.number} of ${due.of}` : due.part === "recorded" ? "Trial" : "Practice");
      setAttribute(card, "data-target", target);
      setAttribute(card, "data-outcome", trial?.outcome ?? "running");
      setAttribute(card, "data-seconds", Math.max(0, Number(trial?.seconds) || 0));
      setAttribute(card, "data-input", Math.max(0, Number(trial?.input) || 0));
      renderBelief(due.display, status?.belief, hello);
      const hand = readings.firstElementChild;
      if (status?.hand) place(hand, status.hand);
      for (const [object, position] of Object.entries(free ? {} : (status?.objects ?? {}))) {
        if (!objects.has(object)) {
          objects.set(object, h("data", { "data-testid": `object-${object}` }));
          readings.append(objects.get(object));
        }
        place(objects.get(object), position);
      }
    },
  };

  /** Only where the study shows what the robot infers. */
  function renderBelief(display, belief, hello) {
    setHidden(shown, display === "nothing" || !belief);
    if (display === "nothing" || !belief) return;
    const leading = Object.entries(belief).reduce((a, b) => (b[1] > a[1] ? b : a));
    const rows = describeObjects(hello).filter((object) => display !== "leading" || object.name === leading[0]);
    const text = rows.map((object) => (display === "leading" ? `The robot expects: ${object.title}` : `${object.title} ${belief[object.name]?.toFixed(2) ?? ""}`)).join("|");
    if (shown.dataset.text === text) return;
    shown.dataset.text = text;
    shown.replaceChildren(...text.split("|").map((line) => h("span", { class: "num" }, line)));
  }
}
