/** Live regions: outcomes and switches politely, a lost connection at once; never probabilities. */

import { describeOutcome } from "./banners.js";
import { byId, setText } from "./dom.js";
import { isAssisted, methodOf } from "./actions.js";
import { inWords } from "./objects.js";
import { describeLostInput, describeLostLine } from "./unattended.js";

/** @param {import("./store.js").Store} store */
export function createAnnouncer(store) {
  const polite = byId("polite");
  const assertive = byId("assertive");
  let before = {};

  return {
    render() {
      const { connection, mode, notices, status } = store.state;
      if (!status) return;
      const now = {
        trial: status.trial.number,
        outcome: status.trial.outcome,
        method: methodOf(store),
        assisted: isAssisted(store),
        mode,
        notice: notices.at(-1)?.id,
        simulated: status.trial.simulated === true,
        unheard: describeLostInput(store.state)?.[0] ?? "",
        state: connection.state,
      };
      const changed = (name) => before.trial !== undefined && now[name] !== before[name];
      if (changed("state")) setText(assertive, now.state === "connected" ? "Connected again." : now.state === "lost" ? "This session has ended." : describeLostLine(store.state));
      const said = [];
      if (changed("trial") || before.trial === undefined) said.push(status.trial.target ? `Grasp the ${inWords(status.trial.target)}.` : "New trial.");
      if (changed("outcome") && now.outcome !== "running") said.push(`${describeOutcome(status.trial)[1]}. Press space for the next trial.`);
      if (changed("method")) said.push(`Method ${now.method}.`);
      if (changed("assisted")) said.push(now.assisted ? "Assistance on." : "Assistance off.");
      if (changed("mode")) said.push(now.mode === "rotate" ? "The sticks rotate the hand." : "The sticks move the hand.");
      if (now.simulated && (changed("simulated") || before.trial === undefined)) said.push("A simulated user is driving. Touch a stick to take over.");
      if (changed("simulated") && !now.simulated) said.push("You are steering.");
      if (changed("unheard") && now.unheard) said.push(`${now.unheard}.`);
      if (changed("notice") && notices.length) said.push(notices.at(-1).text);
      if (said.length) setText(polite, said.join(" "));
      before = now;
    },
  };
}
