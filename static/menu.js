/** The rest, behind "More": directions, devices, the read-only link, what is recorded. */

import { byId, h, icon, setAttribute, setHidden, setText } from "./dom.js";
import { recall, remember } from "./memory.js";

/**
 * @param {import("./store.js").Store} store
 * @param {{help: () => void, pads: () => void, theme: () => void, say: (level: string, text: string) => void}} act
 */
export function createMenu(store, act) {
  const menu = byId("menu");
  const more = byId("more");
  const sheet = byId("sheet");
  store.update({ follow: recall("follow", true) !== false });
  const close = () => store.update({ menu: false });
  const item = (glyph, text, run, props = {}) =>
    h("button", { class: "btn item", type: "button", ...props, on: { click: () => { close(); run(); } } }, icon(glyph), text);
  const follow = h("input", { type: "checkbox", role: "switch", "data-testid": "follow-view", on: { change: () => {
    remember("follow", follow.checked);
    store.update({ follow: follow.checked });
  } } });
  const copy = item("eye", "Copy the link to watch", async () => {
    const link = new URL(store.state.hello?.watch ?? "", location.href).href;
    try {
      await navigator.clipboard.writeText(link);
      act.say("info", "The link to watch is copied.");
    } catch {
      act.say("info", link); // the clipboard needs a secure page; the link can be read off
    }
  });
  const recorded = h("p", { class: "cap" });
  menu.append(
    h("label", { class: "item" }, icon("needle"), "Directions follow the view", follow),
    item("gamepad", "Input devices", act.pads, { "data-testid": "pads-open" }),
    item("gear", "Options", () => store.update({ drawer: true }), { class: "btn item only-phone" }),
    item("theme", "Dark or light", act.theme, { class: "btn item only-phone" }),
    item("help", "Help", act.help, { class: "btn item only-phone" }),
    copy, recorded);
  more.addEventListener("click", () => store.update({ menu: !store.state.menu, drawer: false }));
  addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || !store.state.menu) return;
    close();
    more.focus();
  });
  document.addEventListener("pointerdown", (event) => {
    if (store.state.menu && !sheet.contains(event.target) && !more.contains(event.target)) close();
  });

  return {
    render() {
      const { follow: on, hello, menu: open } = store.state;
      follow.checked = on;
      setHidden(menu, !open);
      sheet.classList.toggle("open", open);
      setAttribute(more, "aria-expanded", open);
      setHidden(copy, !hello?.watch);
      setText(recorded, hello?.recorded === false ? "Trials are not recorded." : "Trials are recorded on this server: your input and the robot’s motion, no name or picture.");
    },
  };
}
