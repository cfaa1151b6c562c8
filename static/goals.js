/** One card per object: its probability now, over the last 20 s, and why it last changed. */

import { byId, h, icon, s, setAttribute, setText } from "./dom.js";
import { describeObjects } from "./objects.js";
import { History, WINDOW } from "./sparkline.js";

const CARDS = 3; // more objects than this become rows

/** @param {import("./store.js").Store} store */
export function createGoals(store) {
  const list = byId("goals");
  /** @type {Map<string, ReturnType<typeof createCard>>} */
  let cards = new Map();
  let built = "";
  let trial = null;

  const build = (objects) => {
    const shape = objects.map(({ name, hue, glyph }) => `${name}/${hue}/${glyph}`).join("|");
    if (shape === built) return;
    built = shape;
    cards = new Map(objects.map((object) => [object.name, createCard(object)]));
    list.replaceChildren(...[...cards.values()].map((card) => card.element));
    list.classList.toggle("rows", objects.length > CARDS);
  };

  return {
    render() {
      const { hello, status } = store.state;
      const belief = status?.belief;
      const shown = hello !== null && (belief !== undefined || status === null);
      list.hidden = !shown;
      if (!shown) return;
      build(describeObjects(hello));
      if (!belief) return;
      if (status.trial.number !== trial) {
        trial = status.trial.number;
        for (const card of cards.values()) card.clear();
      }
      const now = performance.now() / 1000;
      const leader = leading(belief);
      for (const [name, card] of cards) {
        card.render(belief[name] ?? 0, now, {
          target: name === status.trial.target,
          lead: name === leader,
          reason: status.reason?.[name] ?? "",
          live: status.trial.outcome === "running",
        });
      }
    },
  };
}

/** @returns {string} the most probable goal; "" while all are alike */
export function leading(belief) {
  const [first, second] = Object.entries(belief).sort((a, b) => b[1] - a[1]);
  return first && (!second || first[1] - second[1] > 0.005) ? first[0] : "";
}

function createCard({ name, title, hue, glyph }) {
  const number = h("span", { class: "p num" }, "–");
  const pill = h("span", { class: "pill", hidden: true }, "target");
  const bar = h("i");
  const line = s("path", { class: "line" });
  const reason = h("p", { class: "reason cap" });
  const history = new History();
  const element = h("article", { class: "goal panel", role: "listitem", "data-testid": `goal-${name}`, "data-probability": "", dataset: { hue } },
    h("header", {}, icon(glyph), h("span", { class: "name", title }, title), pill, number),
    h("div", { class: "bar" }, bar),
    s("svg", { class: "spark", viewBox: `0 0 ${WINDOW} 26`, preserveAspectRatio: "none", role: "img", "aria-label": `Probability of ${title.toLowerCase()} over the last 20 seconds` },
      s("path", { class: "base", d: `M0 25H${WINDOW}M0 1H${WINDOW}` }), line),
    h("div", { class: "axis cap num", "aria-hidden": "true" }, h("span", {}, "20 s ago"), h("span", {}, "now")),
    reason);
  return {
    element,
    clear: () => history.clear(),
    render(p, now, { target, lead, reason: why, live }) {
      setText(number, p.toFixed(2));
      setAttribute(element, "data-probability", Number(p.toFixed(4)));
      bar.style.setProperty("--p", String(p));
      pill.hidden = !target;
      element.classList.toggle("is-target", target);
      element.classList.toggle("lead", lead);
      setText(reason, why);
      if (reason.title !== why) reason.title = why;
      if (live && history.add(now, p)) setAttribute(line, "d", history.path(now, 1, 25));
    },
  };
}
