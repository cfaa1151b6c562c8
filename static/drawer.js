/** The options of the methods; those of other methods are shown, but off. */

import { methodOf, settingsOf } from "./actions.js";
import { byId, h, setHidden, setText } from "./dom.js";
import { titleOf } from "./objects.js";

const SENTENCES = {
  direct: "Direct gives the sticks alone: the robot watches and does not help.",
  blend: "Blend helps toward the one object it thinks most likely, the more the closer it is.",
  policy: "Policy acts on the whole belief. It starts to move by itself from the start pose.",
  yielding: "Yielding acts on the whole belief, too, but gives way: never against, and little across, the way you push.",
  autonomy: "Autonomy completes the most likely grasp by itself.",
};
const ACTIVE = ["blend", "policy", "yielding", "autonomy"];
const SLIDE_EVERY = 100; // [ms]

/**
 * Setting → how it is offered. `methods`: where it counts. A slider's last step may mean infinity.
 */
const FIELDS = [
  { name: "gain", title: "Assistance gain", methods: ACTIVE, range: [0, 2, 0.05], digits: 2 },
  { name: "full_stick_speed", title: "Speed of full stick", methods: null, range: [0.05, 0.4, 0.01], digits: 2, unit: "m/s" },
  { name: "predictor", title: "Belief", methods: null, choices: { calibrated: "Calibrated", paper: "Paper" } },
  { name: "step", title: "Step", methods: ["policy", "yielding"], choices: { exact: "Exact", "first-order": "First order" } },
  { name: "arbitration", title: "Arbitration", methods: ["blend"], choices: { distance: "Distance", "distance-gate": "Gate", "probability-gate": "Probability" } },
  { name: "arbitration_distance", title: "Blend within D", methods: ["blend"], range: [0.05, 0.5, 0.01], digits: 2, unit: "m" },
  { name: "magnitude", title: "Magnitude", methods: ["blend", "policy", "yielding"], choices: { free: "Free", fixed: "Fixed to input" } },
  { name: "max_speed", title: "Speed limit", methods: null, range: [0.15, 0.6, 0.01], digits: 2, unit: "m/s" },
  { name: "w_f", title: "Yield against (w_f)", methods: ["yielding"], range: [0, 200, 5], digits: 0, unbounded: true },
  { name: "w_l", title: "Yield across (w_l)", methods: ["yielding"], range: [0, 200, 5], digits: 0, unbounded: false },
];

/**
 * @param {import("./store.js").Store} store
 * @param {import("./actions.js").Actions} actions
 */
export function createDrawer(store, actions) {
  const drawer = byId("drawer");
  const sentence = h("p");
  const scene = h("select", { id: "scene", "data-testid": "scene", on: { change: () => actions.newTrial({ scene: scene.value }) } });
  const sceneField = h("label", { class: "field" }, h("span", {}, "Scene"), h("span"), h("span", { class: "select" }, scene));
  const fields = FIELDS.map((field) => (field.range ? slider(field, actions) : choice(field, actions)));
  drawer.append(sentence, ...fields.map(({ element }) => element), sceneField);
  let scenes = "";
  addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || !store.state.drawer) return;
    store.update({ drawer: false });
    byId("options").focus();
  });

  return {
    render() {
      setHidden(drawer, !store.state.drawer);
      if (!store.state.drawer) return;
      const settings = settingsOf(store.state);
      const method = methodOf(store);
      setText(sentence, SENTENCES[method] ?? "");
      for (const field of fields) {
        setHidden(field.element, !(field.name in settings));
        const off = field.methods !== null && !field.methods.includes(method);
        field.element.classList.toggle("off", off);
        field.element.disabled = off;
        setText(field.title, off && field.methods.length === 1 ? `${field.words} (${field.methods[0]} only)` : field.words);
        if (field.name in settings) field.show(store.shown(`settings.${field.name}`, settings[field.name]));
      }
      const names = store.state.hello?.scenes ?? [];
      if (names.join() !== scenes) {
        scenes = names.join();
        scene.replaceChildren(...names.map((name) => h("option", { value: name }, titleOf(name))));
      }
      setHidden(sceneField, names.length < 2);
      const current = store.state.status?.trial.scene ?? store.state.hello?.scene.name;
      if (document.activeElement !== scene && current && scene.value !== current) scene.value = current;
    },
  };
}

function slider({ name, title: words, methods, range, digits, unit, unbounded }, actions) {
  const [min, max, step] = range;
  // The last step of a weight that may grow without bound stands for infinity.
  const top = unbounded ? max + step : max;
  const output = h("output", { class: "num" });
  const title = h("span", { id: `field-${name}` });
  const input = h("input", { type: "range", min, max: top, step, "aria-labelledby": title.id, "data-testid": `setting-${name}` });
  const element = h("fieldset", { class: "field" }, title, output, input);
  const read = () => (unbounded && Number(input.value) > max ? "inf" : Number(input.value));
  const say = (value) => {
    const text = value === "inf" ? "∞" : Number(value).toFixed(digits);
    setText(output, unit ? `${text} ${unit}` : text);
    input.setAttribute("aria-valuetext", output.textContent);
  };
  let timer = 0;
  const send = () => {
    timer = 0;
    actions.settings({ [name]: read() });
  };
  input.addEventListener("input", () => {
    say(read());
    fill(input);
    timer ||= setTimeout(send, SLIDE_EVERY);
  });
  return {
    name, words, methods, element, title,
    show(value) {
      if (timer || input.matches(":active")) return;
      input.value = String(value === "inf" ? top : value);
      say(value);
      fill(input);
    },
  };
}

/** The filled part of a slider's track. */
function fill(input) {
  const share = (Number(input.value) - Number(input.min)) / (Number(input.max) - Number(input.min));
  input.style.setProperty("--v", `${(100 * share).toFixed(1)}%`);
}

function choice({ name, title: words, methods, choices }, actions) {
  const title = h("span", { id: `field-${name}` });
  const buttons = Object.entries(choices).map(([value, text]) =>
    h("button", { type: "button", "aria-pressed": "false", dataset: { value }, on: { click: () => actions.settings({ [name]: value }) } }, text));
  const element = h("fieldset", { class: "field" }, title, h("span"),
    h("div", { class: "seg", role: "group", "aria-labelledby": title.id, "data-testid": `setting-${name}` }, ...buttons));
  return {
    name, words, methods, element, title,
    show(value) {
      for (const button of buttons) button.setAttribute("aria-pressed", String(button.dataset.value === value));
    },
  };
}
