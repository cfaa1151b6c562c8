/** How trials are called in words, and which hue and glyph belong to which object. */

import { describeObjects, inWords } from "../objects.js";

const NAMED = ["canteen", "block", "glass"];

/** Hue and glyph of an object of which only the name is known. */
export function describe(name) {
  const colour = NAMED.find((hue) => name.includes(hue)) ?? "goal-4";
  return describeObjects(/** @type {any} */ ({ scene: { objects: [{ name, colour }] } }))[0];
}

/** @returns {"ok"|"bad"|"dim"} */
export function tone(trial) {
  if (trial.problem) return "bad";
  if (trial.outcome === "grasped") return "ok";
  return trial.outcome === "running" || trial.outcome === "aborted" ? "dim" : "bad";
}

export const outcomeOf = (trial) => (trial.problem ? "unusable" : inWords(trial.outcome));

/** "p07 6": participant and trial. */
export function titleOfTrial(trial) {
  const number = trial.trial ? String(trial.trial) : "?";
  return `${trial.participant || trial.id.split("/").at(-1)} ${number}${trial.attempt > 1 ? `.${trial.attempt}` : ""}`;
}

export const seconds = (value, digits = 2) => (Object.is(value, -0) ? 0 : value).toFixed(digits).replace("-", "−");

export function dateOf(trial) {
  return trial.started_wall_s ? new Date(trial.started_wall_s * 1000).toLocaleDateString(undefined, { dateStyle: "medium" }) : "";
}
