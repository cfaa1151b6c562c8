/** The first visit: how to move, until the first movement; nothing is blocked meanwhile. */

import { byId, setHidden, setText } from "./dom.js";
import { recall, remember } from "./memory.js";
import { inWords } from "./objects.js";

/** @param {import("./store.js").Store} store */
export function createCoach(store) {
  const coach = byId("coach");
  const what = coach.querySelector(".what");
  store.update({ coach: recall("coached", false) !== true });
  return {
    render() {
      const { axes, connection, hello, status } = store.state;
      if (store.state.coach && axes.some((value) => value !== 0)) {
        remember("coached", true);
        store.update({ coach: false });
      }
      const steers = connection.state === "connected" && hello?.control === true && status?.trial.outcome === "running" && !status.trial.simulated;
      const away = status?.loss === "blur" || status?.loss === "hidden"; // a banner says what to do first
      const shown = store.state.coach && steers && !away;
      setHidden(coach, !shown);
      document.body.classList.toggle("pulse", shown);
      const target = status?.trial.target;
      if (shown) setText(what, `Steer to ${target ? `the ${inWords(target)}` : "an object"}, then press Grasp. The robot works out what you want and helps.`);
    },
  };
}
