/** What is drawn in 3-D, from where it is seen, and filling the screen. */

import { byId, h } from "../dom.js";
import { recall, remember } from "../memory.js";

const SWITCHES = [
  ["user", "Input arrow"], ["assist", "Assistance arrow"], ["ghosts", "Intended grasps"],
  ["tags", "Probabilities"], ["path", "Path of the hand"], ["slice", "Value slice"],
];
const CAMERAS = ["operator", "side", "top"];
const FIRST = { user: true, assist: true, ghosts: true, tags: true, path: true, slice: true, slice_of: "belief", slice_plane: "table" };

export function createLayers(page) {
  const layers = { ...FIRST, .../** @type {object} */ (recall("review.layers", {})) };
  layers.slice_of = "belief"; // a goal's name belongs to its scene
  let detail = recall("review.detail", "full") === "plain" ? "plain" : "full";
  let camera = 0;
  const panel = byId("layers");

  const change = (changes) => {
    Object.assign(layers, changes);
    remember("review.layers", layers);
    page.views.tags = layers.tags;
    if (page.socket.ready) page.socket.command("layers", { changes }).catch((error) => page.say(error.message));
  };

  /** Without a graphics card shadows and reflections cost most of the time. */
  const setDetail = (wanted) => {
    detail = wanted;
    remember("review.detail", wanted);
    if (page.socket.ready) page.socket.command("detail", { detail }).catch((error) => page.say(error.message));
  };

  const build = () => {
    const goals = page.trial?.meta.goals ?? [];
    const choice = (name, label, options) => h("label", { class: "field" }, h("span", {}, label), h("span", { class: "select" }, h("select", { on: { change: (event) => change({ [name]: event.target.value }) } }, ...options.map(([value, text]) => h("option", { value, selected: layers[name] === value }, text)))));
    panel.replaceChildren(
      h("h2", {}, "Layers"),
      ...SWITCHES.map(([name, label]) => h("label", { class: "row" }, h("span", {}, label), h("input", { type: "checkbox", role: "switch", checked: layers[name], dataset: { layer: name }, on: { change: (event) => change({ [name]: event.target.checked }) } }))),
      h("label", { class: "row" }, h("span", {}, "Shadows and floor"), h("input", { type: "checkbox", role: "switch", checked: detail === "full", on: { change: (event) => setDetail(event.target.checked ? "full" : "plain") } })),
      choice("slice_of", "Slice shows", [["belief", "V under the belief"], ["soft-min", "V, soft minimum"], ...goals.map((goal) => [goal, `V of ${goal}`])]),
      choice("slice_plane", "Slice lies", [["table", "on the table"], ["hand", "at the hand"], ["vertical", "upright"]]),
    );
  };

  page.pops.add("layers-open", "layers", build);
  byId("camera").addEventListener("click", () => {
    camera = (camera + 1) % CAMERAS.length;
    page.socket.command("camera", { preset: CAMERAS[camera] }).then(() => page.announce(`Camera: ${CAMERAS[camera]}`), (error) => page.say(error.message));
  });
  byId("full").addEventListener("click", () => {
    const stage = byId("views").parentElement;
    if (document.fullscreenElement) document.exitFullscreen();
    else stage.requestFullscreen?.().catch(() => page.say("This browser does not fill the screen here."));
  });
  page.views.tags = layers.tags;
  return {
    /** After a new worker: it draws what this page shows. */
    tell() {
      if (detail !== "full") setDetail(detail);
      change({ ...layers });
    },
  };
}
