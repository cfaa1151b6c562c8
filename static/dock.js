/** Bottom centre: methods, assistance, options, next trial; and the round buttons at the sticks. */

import { hand, isAssisted, methodOf } from "./actions.js";
import { byId, h, icon, setAttribute, setIcon, setText } from "./dom.js";
import { titleOf } from "./objects.js";

/**
 * @param {import("./store.js").Store} store
 * @param {import("./actions.js").Actions} actions
 */
export function createDock(store, actions) {
  const seg = h("div", { class: "seg", role: "group", "aria-label": "Method" });
  const select = h("select", { "aria-label": "Method", on: { change: () => actions.method(select.value) } });
  const menu = h("span", { class: "method-menu" }, select, icon("chevron"));
  const assist = h("button", { class: "toggle", type: "button", role: "switch", "aria-checked": "true", "data-testid": "assist-toggle", title: "Assistance (G)", on: { click: actions.toggleAssist } }, h("i"), "Assist");
  const options = h("button", { class: "btn", type: "button", id: "options", "data-testid": "options", "aria-expanded": "false", "aria-controls": "drawer", on: { click: () => store.update({ drawer: !store.state.drawer, menu: false }) } }, icon("gear"), h("span", {}, "Options"));
  const next = h("button", { class: "btn", type: "button", "data-testid": "new-trial", "aria-label": "New trial", title: "New trial (N)", on: { click: () => actions.newTrial() } }, icon("new"), h("span", {}, "New trial"));
  byId("dock").append(seg, menu, h("span", { class: "bar-v" }), assist, options, next);

  const grasp = byId("grasp");
  const rotate = byId("rotate");
  grasp.addEventListener("click", () => actions.grasp());
  rotate.addEventListener("click", () => actions.toggleMode());
  let built = "";

  const build = (methods) => {
    if (methods.join() === built) return;
    built = methods.join();
    seg.replaceChildren(...methods.map((method, i) =>
      h("button", { type: "button", "data-testid": `method-${method}`, "aria-pressed": "false", title: `${titleOf(method)} (${i + 1})`, dataset: { method }, on: { click: () => actions.method(method) } }, titleOf(method))));
    select.replaceChildren(...methods.map((method) => h("option", { value: method }, titleOf(method))));
  };

  return {
    render() {
      const { hello, mode, drawer, status } = store.state;
      build(hello?.methods ?? []);
      const method = methodOf(store);
      for (const button of seg.children) setAttribute(button, "aria-pressed", button.dataset.method === method);
      if (document.activeElement !== select && select.value !== method) select.value = String(method);
      setAttribute(assist, "aria-checked", isAssisted(store));
      setAttribute(options, "aria-expanded", drawer);
      setAttribute(rotate, "aria-pressed", mode === "rotate");

      const { canGrasp, canOpen, closing } = hand(store.state);
      const label = canOpen ? "Open" : closing ? "Closing" : "Grasp";
      setText(byId("grasp-label"), label);
      setIcon(grasp.firstElementChild, canOpen ? "open" : "grip");
      setAttribute(grasp, "aria-label", canOpen ? "Open the hand" : closing ? "The hand is closing" : "Grasp (space)");
      setAttribute(grasp, "aria-disabled", status !== null && !canGrasp && !canOpen);
    },
  };
}
