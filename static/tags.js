/** The probabilities over the objects: the page's own elements, placed by the picture's camera. */

import { byId, h, setText } from "./dom.js";
import { leading } from "./goals.js";
import { describeObjects } from "./objects.js";
import { layersOf } from "./view-panel.js";

/**
 * @param {import("./store.js").Store} store
 * @param {import("./viewer.js").Viewer} viewer
 */
export function createTags(store, viewer) {
  const parent = byId("tags");
  /** @type {Map<string, {element: HTMLElement, number: HTMLElement}>} */
  let tags = new Map();
  let built = "";

  const build = (objects) => {
    const shape = objects.map(({ name, hue }) => `${name}/${hue}`).join("|");
    if (shape === built) return;
    built = shape;
    tags = new Map(objects.map(({ name, hue }) => {
      const number = h("span", { class: "num" });
      return [name, { number, element: h("div", { class: "tag", hidden: true, dataset: { hue } }, h("i"), number) }];
    }));
    parent.replaceChildren(...[...tags.values()].map(({ element }) => element));
  };

  return {
    /** Each animation frame: tags follow the picture without easing. */
    place() {
      const { connection, hello, status } = store.state;
      const belief = status?.belief;
      const shown = belief !== undefined && connection.state === "connected" && store.shown("layers.tags", layersOf(store.state).tags ?? true);
      build(shown ? describeObjects(hello) : []);
      const leader = shown ? leading(belief) : "";
      for (const [name, { element, number }] of tags) {
        const at = name in belief ? viewer.project(`/tag/${name}`) : null;
        element.hidden = at === null;
        if (at === null) continue;
        setText(number, belief[name].toFixed(2));
        element.classList.toggle("lead", name === leader);
        element.style.transform = `translate(${at[0].toFixed(1)}px, ${at[1].toFixed(1)}px) translate(-50%, -100%)`;
      }
    },
  };
}
