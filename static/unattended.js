/** What the arm does while nobody steers it: some methods move by themselves, and the page says so. */

import { titleOf } from "./objects.js";

/** Why there is no input, as `status.loss` names it, in words for the person who steers. */
const LOSSES = {
  blur: ["Click into the page to steer", "Another window is in front."],
  hidden: ["Click into the page to steer", "The page was hidden."],
  silent: ["Your input does not arrive", "The robot hears nothing from this page."],
};

/**
 * @param {import("./types.js").State} state
 * @returns {"stopped"|"moving"|"unknown"} unknown: a study does not tell the method
 */
export function withoutInput({ hello, status }) {
  const trial = status?.trial;
  if (hello?.hold_on_loss || (trial && trial.phase !== "running")) return "stopped";
  const settings = status?.settings ?? hello?.settings;
  if (!settings || !trial?.method) return "unknown";
  return settings.enabled && trial.method !== "direct" ? "moving" : "stopped";
}

/** A dropped line: what has to be known at once. */
export function describeLostLine(state) {
  if (state.status?.trial.simulated) return "Connection lost. A simulated user goes on.";
  const words = { stopped: "The robot has stopped.", moving: `${titleOf(state.status?.trial.method ?? "")} goes on by itself.`, unknown: "Nobody steers the robot." };
  return `Connection lost. ${words[withoutInput(state)]}`;
}

/**
 * The line holds, and yet no input counts.
 * @returns {[string, string]|null} title and detail; null while input counts
 */
export function describeLostInput(state) {
  const { hello, status } = state;
  const words = LOSSES[status?.loss ?? ""];
  if (!words || hello?.control !== true || status.trial.simulated || status.trial.outcome !== "running") return null;
  const then = { stopped: "The robot stands still.", moving: `${titleOf(status.trial.method)} goes on by itself.`, unknown: "" };
  return [words[0], `${words[1]} ${then[withoutInput(state)]}`.trim()];
}
