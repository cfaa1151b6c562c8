/** Keys: WASD and R/F push the sticks; the arrow keys push the stick that has the focus. */

const SLOW = 0.4; // with Shift held

/** Per key: which axis (left x, left y, right x, right y) and direction, in each mode. */
const KEYS = {
  translate: { KeyW: [3, 1], KeyS: [3, -1], KeyA: [2, -1], KeyD: [2, 1], KeyR: [1, 1], KeyF: [1, -1] },
  rotate: { KeyW: [3, 1], KeyS: [3, -1], KeyA: [2, -1], KeyD: [2, 1], KeyR: [0, -1], KeyF: [0, 1] },
};
const ARROWS = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, 1], ArrowDown: [1, -1] };

/**
 * @param {import("./store.js").Store} store
 * @param {import("./input.js").Input} input
 * @param {import("./actions.js").Actions} actions
 * @param {() => Window|null} viewer the picture's window, whose keys come by message
 */
export function listenToKeys(store, input, actions, viewer) {
  /** @type {Map<string, [number, number]>} */
  const held = new Map();
  let slow = false;

  const send = () => {
    const axes = [0, 0, 0, 0];
    const moves = KEYS[store.state.mode];
    for (const [code, arrow] of held) {
      const [axis, sign] = arrow ?? moves[code];
      axes[axis] += sign;
    }
    const gain = slow ? SLOW : 1;
    const stick = (x, y) => {
      const scale = gain / Math.max(1, Math.hypot(x, y));
      return [x * scale, y * scale];
    };
    input.set("keyboard", "keyboard", "Keyboard", [...stick(axes[0], axes[1]), ...stick(axes[2], axes[3])]);
  };

  const shortcuts = {
    Space: () => actions.graspOrNext(),
    KeyM: () => {
      actions.toggleMode();
      send();
    },
    KeyN: () => actions.newTrial(),
    KeyH: () => actions.help(),
    KeyG: () => actions.toggleAssist(),
    ...Object.fromEntries([1, 2, 3, 4, 5].flatMap((n) => [`Digit${n}`, `Numpad${n}`].map((code) => [code, () => actions.methodNumber(n - 1)]))),
  };

  /** @returns {boolean} whether the key was meant for the robot */
  const down = ({ code, repeat, shiftKey }, arrow) => {
    slow = shiftKey === true;
    if (arrow || code in KEYS.translate) {
      if (!held.has(code)) held.set(code, arrow);
      send();
      return true;
    }
    if (held.size) send(); // Shift alone slows the keys already held
    if (!(code in shortcuts)) return false;
    if (!repeat) shortcuts[code]();
    return true;
  };

  const up = ({ code, shiftKey }) => {
    slow = shiftKey === true;
    if (held.delete(code) || held.size) send();
  };

  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.isComposing) return;
    if (document.querySelector("dialog[open]")) return;
    const target = event.target instanceof Element ? event.target : document.body;
    if (target.closest("select,textarea,input:not([type=checkbox],[type=range])")) return;
    // A button reached by Tab keeps its space bar.
    if (event.code === "Space" && target.matches("button:focus-visible,input:focus-visible")) return;
    const arrow = target.closest(".stick") && arrowOf(target.closest(".stick"), event.code);
    if (down(event, arrow || undefined)) event.preventDefault();
  });
  addEventListener("keyup", up);
  addEventListener("message", ({ source, origin, data }) => {
    if (source !== viewer() || origin !== location.origin || typeof data?.code !== "string") return;
    if (data.ctrlKey || data.altKey || data.metaKey) return;
    if (data.type === "keydown") down(data);
    else if (data.type === "keyup") up(data);
  });
  input.releases.push(() => {
    held.clear();
    send();
  });
}

function arrowOf(stick, code) {
  const arrow = ARROWS[code];
  if (!arrow) return undefined;
  return [arrow[0] + (stick.id === "stick-right" ? 2 : 0), arrow[1]];
}
