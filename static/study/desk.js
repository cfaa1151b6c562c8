/** The experimenter's desk: asks every two seconds, shows, and sends what is to be done. */

import { byId, h, setText } from "../dom.js";

const LOOK_EVERY = 2000; // [ms]
const root = byId("desk");
const error = h("p", { class: "error", role: "alert" });
let shown = "";

async function ask(wish) {
  try {
    const response = await fetch("/api/desk", wish ? { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(wish) } : { cache: "no-store" });
    const answer = await response.json();
    setText(error, answer.error ?? "");
    if (answer.login) login(answer.password);
    else if (answer.people) show(answer);
    if (answer.link) prompt("This link goes on with the participation in another browser, once:", location.origin + answer.link);
    return answer;
  } catch {
    setText(error, "The server does not answer.");
    return {};
  }
}

function login(hasPassword) {
  if (shown === "login") return;
  shown = "login";
  if (!hasPassword) return void root.replaceChildren(h("div", { class: "login" }, h("h1", {}, "No password yet"), h("p", {}, "Set one on the server: hindsight study password"), error));
  const field = h("input", { type: "password", autocomplete: "current-password", "aria-label": "Password", "data-testid": "password" });
  const form = h("form", { class: "login", on: { submit: (event) => { event.preventDefault(); ask({ password: field.value }); } } },
    h("h1", {}, "Experimenter's desk"), field, h("button", { class: "btn primary", "data-testid": "login" }, "Log in"), error);
  root.replaceChildren(form);
  field.focus();
}

function show(state) {
  const now = JSON.stringify(state);
  if (now === shown) return;
  shown = now;
  const total = state.cells.reduce((sum, cell) => sum + cell.completed, 0);
  root.replaceChildren(
    h("header", {}, h("h1", {}, state.study + (state.test ? " (test run)" : "")),
      h("span", { class: "dim num" }, `${state.places[0]} of ${state.places[1]} places taken`),
      h("button", { class: "btn line", type: "button", "data-testid": "pause", "aria-pressed": String(state.paused), on: { click: () => ask({ do: "pause", on: !state.paused }) } }, state.paused ? "Take new participants again" : "Pause recruiting"),
      h("a", { class: "btn line", href: state.pilot }, "Pilot link"),
      h("a", { class: "btn line", href: "/?next" }, "Next on this machine"),
      h("a", { class: "btn line", href: "/desk/download" }, "Download"),
      h("button", { class: "btn", type: "button", on: { click: () => ask({ do: "logout" }) } }, "Log out")),
    error,
    h("div", { class: "cells" }, h("div", { class: "panel" }, h("b", { class: "num" }, `${total} of ${state.wanted}`), h("span", { class: "dim" }, "completed")),
      ...state.cells.map((cell) => h("div", { class: "panel", "data-testid": `cell-${cell.cell}` }, h("b", { class: "num" }, String(cell.completed)), h("span", { class: "dim" }, `cell ${cell.cell}, ${cell.running} running`)))),
    h("table", {}, h("thead", {}, h("tr", {}, ...["Participant", "Cell", "Where", "Line", "Trials", ""].map((text) => h("th", { scope: "col" }, text)))),
      h("tbody", {}, ...state.people.map(row))));
}

function row(person) {
  const open = person.status === "running";
  const where = open ? `${person.step} ${person.page} (${person.at[0]}/${person.at[1]})${person.phase ? `, ${person.phase}` : ""}` : `${person.status}${person.why ? `: ${person.why}` : ""}`;
  const line = [person.here ? "here" : open ? `silent ${person.silent_s} s` : "", person.round_trip_ms ? `${Math.round(person.round_trip_ms)} ms` : "", person.late_share ? `${(100 * person.late_share).toFixed(1)} % late` : ""].filter(Boolean).join(", ");
  const act = (text, wish, sure) => h("button", { type: "button", on: { click: () => (!sure || confirm(`${text}: ${person.id}?`)) && ask({ participant: person.id, ...wish }) } }, text);
  return h("tr", { "data-testid": `person-${person.id}` },
    h("td", {}, h("b", {}, person.id), person.pilot ? h("span", { class: "pill" }, "pilot") : null, person.notes ? h("span", { class: "dim" }, ` ${person.notes} notes`) : null),
    h("td", { class: "num" }, String(person.cell)), h("td", {}, where), h("td", { class: "num" }, line),
    h("td", {}, h("div", { class: "marks" }, ...person.trials.map((trial) => h("button", {
      type: "button", dataset: { outcome: trial.outcome }, title: `${trial.part}, ${trial.label}, ${trial.target}, attempt ${trial.attempt}: ${trial.outcome}`,
      on: { click: () => open && confirm(`Mark ${trial.target} with ${trial.label} as failed, and have it repeated?`) && ask({ do: "fail", participant: person.id, index: trial.index }) },
    }, `${trial.part === "recorded" ? "" : "p"}${trial.target.slice(0, 1)}`)))),
    h("td", {}, h("div", { class: "acts" },
      open ? h("a", { href: `/desk/watch/${person.id}`, target: "_blank", rel: "noreferrer" }, "watch") : null,
      open ? act("redo", { do: "redo" }, true) : null, open ? act("skip", { do: "skip" }, true) : null,
      h("button", { type: "button", on: { click: () => { const text = prompt(`Note on ${person.id}:`); if (text) ask({ do: "note", participant: person.id, text }); } } }, "note"),
      open ? act("new link", { do: "link" }, true) : null, open ? act("end", { do: "end" }, true) : null)));
}

ask();
setInterval(() => shown !== "login" && !document.hidden && ask(), LOOK_EVERY);
