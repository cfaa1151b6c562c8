/** Cameras, layers and the value function's legend. */

import { byId, h, icon, setAttribute, setHidden, setText } from "./dom.js";
import { describeObjects } from "./objects.js";

const CAMERAS = { operator: "Operator", side: "Side", top: "Top" };
/** Layer, its words, its icon, and the token of its colour. */
const LAYERS = [
  ["user", "Your input", "arrow", "user"],
  ["assist", "Assistance", "arrow", "assist"],
  ["ghosts", "Grasp ghosts", "ghost", ""],
  ["tags", "Probabilities", "tag", ""],
  ["path", "Hand path", "path", ""],
  ["slice", "Value slice", "field", ""],
];
const PLANES = { table: "on the table", hand: "level with the hand", vertical: "upright at the hand" };

/** Layers as the robot draws them. */
export function layersOf({ hello, status }) {
  return status?.layers ?? hello?.layers ?? {};
}

/**
 * @param {import("./store.js").Store} store
 * @param {import("./actions.js").Actions} actions
 */
export function createViewPanel(store, actions) {
  const panel = byId("view");
  const cameras = Object.entries(CAMERAS).map(([name, title]) =>
    h("button", { type: "button", "aria-pressed": "false", dataset: { camera: name }, on: { click: () => actions.camera(name) } }, title));
  const switches = new Map(LAYERS.map(([name, title, glyph, hue]) => {
    const input = h("input", { type: "checkbox", role: "switch", "data-testid": `layer-${name}`, on: { change: () => actions.layers({ [name]: input.checked }) } });
    return [name, { input, label: h("label", { dataset: { hue } }, icon(glyph, "k"), title, input) }];
  }));
  const value = h("select", { "data-testid": "slice-of", on: { change: () => actions.layers({ slice_of: value.value }) } });
  const plane = h("select", { "data-testid": "slice-plane", on: { change: () => actions.layers({ slice_plane: plane.value }) } },
    ...Object.entries(PLANES).map(([name, title]) => h("option", { value: name }, title)));
  const picks = h("div", { class: "pick" },
    h("label", {}, h("span", { class: "dim" }, "Value"), value, icon("chevron")),
    h("label", {}, h("span", { class: "dim" }, "Plane"), plane, icon("chevron")));
  const layers = h("div", { class: "layers", id: "layers", role: "group", "aria-label": "Layers" }, ...[...switches.values()].map(({ label }) => label));
  const count = h("span", { class: "dim count" });
  const open = h("button", { class: "btn line layers-btn", type: "button", "aria-expanded": "false", "aria-controls": "layers", on: { click: () => store.update({ layersOpen: !store.state.layersOpen }) } },
    icon("field"), "Layers", count);
  const far = h("span");
  const near = h("span");
  const legend = h("div", { class: "legend" }, h("div", { class: "ramp" }), h("div", { class: "axis cap num" }, far, h("span", {}, "cost to go V [nat]"), near));
  panel.append(
    h("div", { class: "cameras" },
      h("div", { class: "seg", role: "group", "aria-label": "Camera" }, ...cameras),
      h("button", { class: "icon", type: "button", "aria-label": "Reset the camera", on: { click: () => actions.camera("reset") } }, icon("home"))),
    open, layers, h("div", { class: "value" }, picks, legend));
  let goals = "";

  return {
    render() {
      const { hello, status } = store.state;
      const layers = layersOf(store.state);
      const camera = store.shown("camera", status?.camera ?? "operator");
      for (const button of cameras) setAttribute(button, "aria-pressed", button.dataset.camera === camera);
      let on = 0;
      let known = 0;
      for (const [name, { input, label }] of switches) {
        setHidden(label, !(name in layers));
        input.checked = Boolean(store.shown(`layers.${name}`, layers[name]));
        known += Number(name in layers);
        on += Number(name in layers && input.checked);
      }
      setText(count, `${on} of ${known}`);
      setAttribute(open, "aria-expanded", store.state.layersOpen);
      panel.classList.toggle("open", store.state.layersOpen);

      const objects = describeObjects(hello);
      const names = objects.map(({ name }) => name).join("|");
      if (names !== goals) {
        goals = names;
        value.replaceChildren(h("option", { value: "belief" }, "belief-weighted"), h("option", { value: "soft-min" }, "soft-min of all"),
          ...objects.map(({ name, title }) => h("option", { value: name }, `of the ${title.toLowerCase()}`)));
      }
      pick(value, store.shown("layers.slice_of", layers.slice_of));
      pick(plane, store.shown("layers.slice_plane", layers.slice_plane));
      const range = status?.value_range;
      const sliced = Boolean(store.shown("layers.slice", layers.slice));
      setHidden(picks, !sliced);
      setHidden(legend, !sliced || !range);
      setHidden(legend.parentElement, !sliced);
      if (range) {
        setText(near, nat(range[0]));
        setText(far, nat(range[1]));
      }
    },
  };
}

function pick(select, value) {
  setHidden(select.parentElement, value === undefined);
  // A list that is open must not be changed under the person's hand.
  if (value !== undefined && select.value !== value && document.activeElement !== select) select.value = String(value);
}

function nat(value) {
  return Math.abs(value) < 10 ? value.toFixed(1) : value.toFixed(0);
}
