/** What this browser remembers of its user's choices; works without storage, too. */

const PREFIX = "hindsight.";

/** @returns {unknown} the stored value, or `fallback` where there is none or it cannot be read */
export function recall(key, fallback) {
  try {
    const text = localStorage.getItem(PREFIX + key);
    return text === null ? fallback : JSON.parse(text);
  } catch {
    return fallback;
  }
}

export function remember(key, value) {
  try {
    localStorage.setItem(PREFIX + key, JSON.stringify(value));
  } catch {
    // Storage is full or forbidden: the choice lasts as long as the page.
  }
}
