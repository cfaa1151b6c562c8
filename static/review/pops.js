/** Panels that open from a button; one at a time, closed by Escape or a click elsewhere. */

import { byId, setAttribute, setHidden } from "../dom.js";

export function createPops() {
  /** @type {Map<HTMLElement, {button: HTMLElement, opened: () => void, sticky: boolean}>} */
  const known = new Map();

  const close = (except = null) => {
    for (const [panel, { button, sticky }] of known) {
      if (panel === except || panel.hidden || (sticky && except !== null)) continue;
      setHidden(panel, true);
      setAttribute(button, "aria-expanded", false);
      if (panel.contains(document.activeElement)) button.focus();
    }
  };

  const toggle = (panel) => {
    const { button, opened } = known.get(panel);
    const open = panel.hidden;
    if (open) close(panel);
    setHidden(panel, !open);
    setAttribute(button, "aria-expanded", open);
    if (open) {
      opened();
      /** @type {HTMLElement|null} */ (panel.querySelector("button, input, select, textarea"))?.focus();
    } else button.focus();
  };

  document.addEventListener("pointerdown", (event) => {
    const target = /** @type {Node} */ (event.target);
    for (const [panel, { button, sticky }] of known) {
      if (!sticky && !panel.hidden && !panel.contains(target) && !button.contains(target)) {
        setHidden(panel, true);
        setAttribute(button, "aria-expanded", false);
      }
    }
  });
  addEventListener("keydown", (event) => {
    if (event.key === "Escape") close();
  });

  return {
    /** @param {string} buttonId @param {string} panelId @param {() => void} opened @param {boolean} [sticky] stays while others open */
    add(buttonId, panelId, opened = () => {}, sticky = false) {
      const [button, panel] = [byId(buttonId), byId(panelId)];
      known.set(panel, { button, opened, sticky });
      button.addEventListener("click", () => toggle(panel));
    },
    toggle: (panelId) => toggle(byId(panelId)),
    close,
  };
}
