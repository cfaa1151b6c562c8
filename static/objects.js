/** What is known of each object by its name: hue, glyph, and how it is called. */

const HUES = ["canteen", "block", "glass", "goal-4", "goal-5"];
const GLYPHS = {
  canteen: "canteen", bottle: "canteen", flask: "canteen",
  block: "block", box: "block", cube: "block",
  glass: "glass", cup: "glass", mug: "glass",
  cylinder: "cylinder", can: "cylinder", tin: "cylinder",
  ball: "ball", sphere: "ball",
};

/**
 * @param {import("./types.js").Hello|null} hello
 * @returns {{name: string, title: string, hue: string, glyph: string}[]} in the scene's order
 */
export function describeObjects(hello) {
  return (hello?.scene?.objects ?? []).map((object, i) => ({
    name: object.name,
    title: titleOf(object.name),
    hue: HUES.includes(object.colour) ? object.colour : HUES[i % HUES.length],
    glyph: glyphOf(object),
  }));
}

/** "red_block" → "Red block" */
export function titleOf(name) {
  const words = String(name).replaceAll(/[-_]+/g, " ").trim();
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** The name within a sentence. */
export function inWords(name) {
  return String(name).replaceAll(/[-_]+/g, " ").trim();
}

function glyphOf({ name, kind }) {
  const words = [kind, ...String(name).toLowerCase().split(/[^a-z]+/).reverse()];
  return words.map((word) => Object.hasOwn(GLYPHS, word ?? "") && GLYPHS[word]).find(Boolean) || "object";
}
