/** The keyboard: everything the mouse can do, and step by step. */

import { byId } from "../dom.js";

const IN_FIELDS = "input:not([type=checkbox]), textarea, select, [contenteditable]";

export function listenToKeys(page, help) {
  const { player, timeline } = page;
  const by = (steps) => () => {
    player.pause();
    player.seek(player.step + steps);
  };
  const keys = {
    " ": () => player.toggle(), k: () => player.toggle(),
    ArrowLeft: by(-1), ArrowRight: by(1), "shift+ArrowLeft": by(-10), "shift+ArrowRight": by(10),
    PageDown: by(-100), PageUp: by(100), j: by(-100), l: by(100),
    Home: () => player.seek(0), End: () => player.seek(player.steps - 1),
    "[": () => timeline.jump(-1), "]": () => timeline.jump(1),
    f: () => page.notes.toggleFlag(), n: () => page.pops.toggle("notes"), w: () => page.pops.toggle("what-if-panel"),
    "shift+ArrowUp": () => go(-1), "shift+ArrowDown": () => go(1), p: () => go(-1), o: () => go(1),
    h: () => help.open(), "?": () => help.open(), "/": () => byId("search").focus(),
  };
  const go = (step) => {
    const trial = page.list.neighbour(step);
    if (trial && trial.id !== page.list.current) page.open(trial.id);
  };

  const press = (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = /** @type {HTMLElement} */ (event.target);
    if (target.matches?.(IN_FIELDS) || document.querySelector("dialog[open]")) return;
    const shifted = event.shiftKey && event.key.startsWith("Arrow");
    const act = keys[shifted ? `shift+${event.key}` : event.key.length === 1 ? event.key.toLowerCase() : event.key];
    // Buttons keep their own space and enter.
    if (!act || (event.key === " " && target.closest?.("button, [role=switch]"))) return;
    if (!page.trial && !["h", "?", "/"].includes(event.key)) return;
    event.preventDefault();
    act();
  };
  addEventListener("keydown", press);
  // The picture posts the keys that were pressed in it.
  addEventListener("message", (event) => {
    if (event.origin !== location.origin || event.data?.type !== "keydown") return;
    press({ ...event.data, target: document.body, preventDefault: () => {} });
  });
}
