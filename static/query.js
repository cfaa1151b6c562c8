/** `?method=…&target=…&seed=…&scene=…` starts that trial, so that a demo is reproducible. */

const NAMES = ["method", "target", "seed", "scene"];

/**
 * @param {string} search the page's query
 * @returns {Record<string, string|number>|null} the fields of `new-trial`; the robot judges values
 */
export function trialFromQuery(search) {
  const query = new URLSearchParams(search);
  const asked = NAMES.filter((name) => query.get(name));
  if (!asked.length) return null;
  return Object.fromEntries(asked.map((name) => {
    const text = query.get(name) ?? "";
    return [name, name === "seed" && /^-?\d{1,15}$/.test(text) ? Number(text) : text];
  }));
}
