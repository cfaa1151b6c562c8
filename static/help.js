/** The help sheet: how to read the screen, and every control of every device. */

import { byId, h, icon } from "./dom.js";

const READ = [
  ["user", "Yellow is you", "what the sticks ask for, at the hand and on the stick."],
  ["assist", "Pink is the robot’s help", "what it adds to that. Both together are how the hand moves."],
  ["", "The cards", "how likely the robot thinks each object is what you want, now and over the last 20 s, from your input alone."],
  ["", "The ghost", "the grasp the robot is heading for."],
  ["", "The coloured table", "the cost to go: how much effort is left from each place. The ramp’s end marked with the lower number is near the goal."],
  ["", "The line below the hand", "where it stands over the table; the side view shows its height."],
];
const CONTROLS = [
  ["Over the table", "right stick", "W A S D", "right stick"],
  ["Height", "left stick", "R F", "left stick"],
  ["Finer", "push less", "hold Shift", "push less"],
  ["Grasp; after the outcome, next trial", "Grasp", "space", "A"],
  ["Move or rotate", "Rotate", "M", "LB, RB"],
  ["Assistance on or off", "Assist", "G", "X"],
  ["New trial", "New trial", "N", "Y, Start"],
  ["Method", "bottom row", "1 to 5", "–"],
  ["Help", "?", "H", "–"],
];

export function createHelp() {
  const dialog = /** @type {HTMLDialogElement} */ (byId("help"));
  const cell = (text, i) => (i === 0 ? h("th", { scope: "row" }, text) : h("td", {}, ...(i === 2 && text !== "–" ? keys(text) : [text])));
  dialog.append(
    h("header", {}, h("h2", { id: "help-title" }, "How to steer, and how to read the screen"),
      h("button", { class: "icon", type: "button", "aria-label": "Close", on: { click: () => dialog.close() } }, icon("close"))),
    h("p", {}, "Bring the hand to the object named at the top left and close it. You steer; the robot infers which object you want and helps. Rotating uses the same sticks: right is roll and pitch, left is yaw."),
    h("table", {}, h("thead", {}, h("tr", {}, ...["", "Screen", "Keys", "Gamepad"].map((text) => h("th", { scope: "col" }, text)))),
      h("tbody", {}, ...CONTROLS.map((row) => h("tr", {}, ...row.map(cell))))),
    h("dl", {}, ...READ.flatMap(([hue, title, text]) => [h("dt", { dataset: { hue } }, hue ? icon("arrow", "k") : null, title), h("dd", {}, text)])),
    h("p", { class: "dim" }, "Click a stick or reach it with Tab to push it with the arrow keys. When the page loses the focus or the connection, your input becomes zero at once; what helps may go on by itself, and the page says so."),
  );
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  dialog.addEventListener("keydown", (event) => {
    if (event.code !== "KeyH" || event.ctrlKey || event.metaKey) return;
    event.stopPropagation(); // the page would open it again
    dialog.close();
  });
  return { open: () => !dialog.open && dialog.showModal() };
}

function keys(text) {
  return text.split(" ").map((word) => (/^([A-Z0-9]|space|Shift)$/.test(word) ? h("kbd", {}, word) : ` ${word} `));
}
