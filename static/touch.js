/**
 * Buttons for the second hand. While one finger holds a stick, browsers make no click of another
 * finger's tap; this does.
 */

const TWICE = 400; // a browser's own click after ours is the same tap [ms]

export function clickWithAnyFinger() {
  /** @type {Map<number, Element>} */
  const down = new Map();
  let clicked = { target: null, at: -Infinity };
  const button = (event) => (event.target instanceof Element ? event.target.closest("button,label") : null);

  document.addEventListener("pointerdown", (event) => {
    const target = button(event);
    if (event.pointerType === "touch" && !event.isPrimary && target) down.set(event.pointerId, target);
  });
  document.addEventListener("pointercancel", (event) => down.delete(event.pointerId));
  document.addEventListener("pointerup", (event) => {
    const target = down.get(event.pointerId);
    down.delete(event.pointerId);
    if (!target || target !== button(event)) return;
    target.click();
    clicked = { target, at: performance.now() };
  });
  document.addEventListener("click", (event) => {
    if (event.isTrusted && button(event) === clicked.target && performance.now() - clicked.at < TWICE) {
      event.preventDefault();
      event.stopImmediatePropagation();
    }
    // A button that was clicked, not reached by Tab, gives the space bar back to the hand.
    if (event.detail > 0 && !document.querySelector("dialog[open]")) button(event)?.blur();
  }, true);
}
