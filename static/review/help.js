/** What the keys do, and what the terminal does with the same logs. */

import { byId, h } from "../dom.js";

const KEYS = [
  ["Play, pause", "space"], ["One tick back, on", "←", "→"], ["Ten ticks", "shift ←", "shift →"], ["A second", "J", "L"],
  ["Event before, after", "[", "]"], ["Begin, end", "Home", "End"], ["Trial before, after", "P", "O"],
  ["Flag", "F"], ["Notes", "N"], ["What would have been", "W"], ["Search", "/"], ["Help", "H"],
];

export function createHelp() {
  const dialog = /** @type {HTMLDialogElement} */ (byId("help"));
  dialog.append(
    h("header", {}, h("h2", { id: "help-title" }, "Review"), h("button", { type: "button", class: "icon", "aria-label": "Close", on: { click: () => dialog.close() } }, "×")),
    h("p", {}, "Yellow is the person, pink the robot's help, each object has its own hue. Dashed curves are recomputed: the assistance had the goal been known, or what would have been. Click a curve to go there, drag across to zoom, double-click to see all."),
    h("table", {}, h("tbody", {}, ...KEYS.map(([what, ...keys]) => h("tr", {}, h("th", { scope: "row" }, what), h("td", {}, ...keys.map((key) => h("kbd", {}, key))))))),
    h("p", {}, "In the terminal: ", h("kbd", {}, "hindsight export FOLDER"), " writes tables, ", h("kbd", {}, "hindsight verify FOLDER"), " re-simulates logs bit for bit."),
  );
  byId("help-open").addEventListener("click", () => dialog.showModal());
  return { open: () => dialog.showModal() };
}
