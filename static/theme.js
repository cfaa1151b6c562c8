/** Dark or light: the page's tokens, and the picture's through the robot. */

import { byId, setAttribute } from "./dom.js";
import { recall, remember } from "./memory.js";

/**
 * @param {import("./store.js").Store} store
 * @param {import("./socket.js").Socket} socket
 */
export function createTheme(store, socket) {
  const button = byId("theme");
  const stored = recall("theme", "dark");
  const apply = (theme) => {
    document.documentElement.dataset.theme = theme;
    store.update({ theme });
  };
  apply(stored === "light" ? "light" : "dark");
  const tell = () => store.state.hello?.control && socket.command("theme", { theme: store.state.theme });
  const toggle = () => {
    apply(store.state.theme === "dark" ? "light" : "dark");
    remember("theme", store.state.theme);
    tell();
  };
  button.addEventListener("click", toggle);
  return {
    toggle,
    /** After hello: the picture follows the page. */
    tell,
    render: () => setAttribute(button, "aria-label", store.state.theme === "dark" ? "Light theme" : "Dark theme"),
  };
}
