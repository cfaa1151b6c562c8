/**
 * A small drawing from the side: how far away, and how high. One picture does not show depth, so the
 * axis that the picture hides (along the operator's view) is the one drawn across.
 */

import { byId, h, s, setAttribute, setHidden, setText } from "./dom.js";
import { describeObjects } from "./objects.js";

const WIDTH = 220;
const HEIGHT = 74;
const SCALE = 200; // [px/m]
const FLOOR = HEIGHT - 8; // where the table's top is drawn

/** @param {import("./store.js").Store} store */
export function createSideView(store) {
  const panel = byId("side");
  const height = h("b", { class: "num" });
  const plumb = s("path", { class: "plumb" });
  const grip = s("use", { href: "/static/icons.svg#ghost", width: 16, height: 16 });
  const things = s("g");
  panel.append(
    h("header", {}, h("span", {}, "From the side"), height),
    s("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": "Height and distance of the hand and the objects" },
      s("path", { class: "floor", d: `M0 ${FLOOR}H${WIDTH}` }), things, plumb, grip),
    h("div", { class: "axis cap", "aria-hidden": "true" }, h("span", {}, "near"), h("span", {}, "away")));
  let built = "";
  /** @type {Map<string, SVGElement>} */
  let marks = new Map();

  const build = (objects) => {
    const shape = objects.map(({ name, hue, glyph }) => `${name}/${hue}/${glyph}`).join("|");
    if (shape === built) return;
    built = shape;
    marks = new Map(objects.map(({ name, hue, glyph }) => [name, s("use", { href: `/static/icons.svg#${glyph}`, width: 22, height: 22, "data-hue": hue })]));
    things.replaceChildren(...marks.values());
  };

  return {
    render() {
      const { coach, connection, hello, status, viewYaw } = store.state;
      const positions = status?.objects;
      const shown = Boolean(status?.hand && positions) && connection.state === "connected" && !coach;
      setHidden(panel, !shown);
      if (!shown) return;
      build(describeObjects(hello));
      // Distance along the view, measured from the middle of the objects.
      const along = ([x, y]) => x * Math.cos(viewYaw) + y * Math.sin(viewYaw);
      const all = Object.values(positions).map(along);
      const middle = (Math.min(...all) + Math.max(...all)) / 2 || 0;
      const across = (point) => Math.max(8, Math.min(WIDTH - 8, WIDTH * 0.56 + SCALE * (along(point) - middle)));
      const level = (z) => Math.max(8, FLOOR - SCALE * z);
      for (const [name, mark] of marks) {
        const at = positions[name];
        setAttribute(mark, "visibility", at ? "visible" : "hidden");
        if (!at) continue;
        setAttribute(mark, "x", (across(at) - 11).toFixed(1));
        setAttribute(mark, "y", (level(at[2]) - 11).toFixed(1));
      }
      const [x, y] = [across(status.hand), level(status.hand[2])];
      setAttribute(plumb, "d", `M${x.toFixed(1)} ${y.toFixed(1)}V${FLOOR}`);
      setAttribute(grip, "x", (x - 8).toFixed(1));
      setAttribute(grip, "y", (y - 9).toFixed(1));
      setText(height, `${(100 * status.hand[2]).toFixed(0)} cm up`);
    },
  };
}
