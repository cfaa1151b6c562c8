/** What has to be read now: how the trial ended, that the line is down, what was refused. */

import { byId, h, icon, setHidden, setIcon, setText } from "./dom.js";
import { inWords } from "./objects.js";
import { seconds } from "./trial.js";
import { describeLostInput, describeLostLine } from "./unattended.js";

const ICONS = { ok: "check", warn: "warn", bad: "cross", info: "info" };
const NOTICE_STAYS = { info: 4000, warn: 8000, error: 10_000 }; // [ms]
const MOST_NOTICES = 3;
const LOSS_SHOWN_AFTER = 700; // shorter ones pass with a click or a slow frame [ms]

/** Words for an outcome and how bad it is. */
export function describeOutcome({ outcome, target, grasped }) {
  const it = target ? `the ${inWords(target)}` : "it";
  switch (outcome) {
    case "grasped": return ["ok", `Grasped ${it}`];
    case "wrong_object": return ["bad", grasped ? `Grasped the ${inWords(grasped)}, not ${it}` : "Grasped another object"];
    case "closed_on_nothing": return ["warn", "The hand closed on nothing"];
    case "bad_grip": return ["warn", "The grip did not hold"];
    case "knocked_over": return ["bad", "An object was knocked over"];
    case "fell_off": return ["bad", "An object fell off the table"];
    case "timeout": return ["warn", "Time is up"];
    case "done": return ["ok", "The trial is finished"];
    case "interrupted": return ["warn", "The trial was interrupted"];
    default: return ["warn", "The trial was ended"];
  }
}

/**
 * @param {import("./store.js").Store} store
 * @param {{newTrial: () => void, retry: () => void}} act
 */
export function createBanners(store, act) {
  const outcome = createBanner("outcome", "New trial", "new", act.newTrial);
  const lost = createBanner("lost", "Try now", null, () => (store.state.connection.state === "lost" ? location.reload() : act.retry()));
  const watching = createBanner("watching", null, null, null);
  const simulated = createBanner("simulated", null, null, null);
  const unheard = createBanner("unheard", null, null, null);
  let heardAt = performance.now();
  const notices = h("div", { class: "notices", role: "log", "aria-label": "Messages" });
  byId("banners").append(lost.element, outcome.element, watching.element, simulated.element, unheard.element, notices);
  /** @type {Map<number, HTMLElement>} */
  const shown = new Map();

  const renderNotices = () => {
    for (const notice of store.state.notices) {
      if (shown.has(notice.id)) continue;
      const severity = notice.level === "error" ? "bad" : notice.level === "warn" ? "warn" : "info";
      const drop = () => store.update({ notices: store.state.notices.filter(({ id }) => id !== notice.id) });
      const element = h("div", { class: `notice panel ${severity}` }, icon(ICONS[severity]), h("span", { class: "text" }, notice.text),
        h("button", { class: "icon", type: "button", "aria-label": "Dismiss", on: { click: drop } }, icon("close")));
      shown.set(notice.id, element);
      notices.append(element);
      setTimeout(drop, NOTICE_STAYS[notice.level] ?? NOTICE_STAYS.info);
    }
    const ids = new Set(store.state.notices.map(({ id }) => id));
    for (const [id, element] of shown) {
      if (ids.has(id)) continue;
      shown.delete(id);
      element.remove();
    }
  };

  return {
    render() {
      const { connection, hello, status } = store.state;
      const down = connection.state !== "connected";
      const trial = status?.trial;
      const over = trial !== undefined && trial.outcome !== "running";
      setHidden(outcome.element, !over || down);
      if (over) {
        const [severity, words] = describeOutcome(trial);
        const saved = hello?.recorded === false ? "not recorded" : "saved";
        outcome.show(severity, words, `${seconds(trial.seconds)} s, input ${seconds(trial.input)} s, ${saved}`);
        setHidden(outcome.button, hello?.control === false);
      }
      setHidden(lost.element, !down || (connection.state === "reconnecting" && !connection.before));
      if (down) lost.show(...describeLoss(store.state));
      setText(lost.button, connection.state === "lost" ? "Start again" : "Try now");
      const driven = trial?.simulated === true;
      setHidden(watching.element, hello?.control !== false || down || over);
      watching.show("info", "You are watching", driven ? "A simulated user is driving." : "Someone else is steering.");
      setHidden(simulated.element, !driven || hello?.control !== true || down || over);
      simulated.show("info", "A simulated user is driving", "Touch a stick to take over.");
      const loss = down ? null : describeLostInput(store.state);
      if (!loss) heardAt = performance.now();
      setHidden(unheard.element, !loss || performance.now() - heardAt < LOSS_SHOWN_AFTER);
      if (loss) unheard.show("warn", ...loss);
      renderNotices();
    },
  };
}

function describeLoss(page) {
  const { state, retryAt, reason } = page.connection;
  if (state === "lost") return ["bad", "This session has ended", reason || "The robot is no longer there."];
  const wait = retryAt === null ? 0 : Math.max(0, Math.ceil((retryAt - performance.now()) / 1000));
  const when = wait > 0 ? `Trying again in ${wait} s.` : "Trying again now.";
  return ["warn", describeLostLine(page), page.status?.trial.outcome === "running" ? `${when} This trial will continue.` : when];
}

function createBanner(id, action, actionIcon, act) {
  const title = h("b");
  const line = h("span", { class: "cap num" });
  const glyph = icon("info");
  const button = h("button", { class: id === "outcome" ? "btn primary" : "btn line", type: "button", "data-testid": `${id}-action`, on: { click: act ?? (() => {}) } },
    actionIcon ? icon(actionIcon) : null, action ?? "");
  const element = h("div", { class: "banner panel", id, hidden: true, "data-testid": `banner-${id}` }, glyph, h("div", {}, title, line), action ? button : null);
  return {
    element,
    button,
    show(severity, words, detail) {
      element.className = `banner panel ${severity}`;
      setIcon(glyph, ICONS[severity]);
      setText(title, words);
      setText(line, detail);
    },
  };
}

/**
 * Show a notice for a while.
 * @param {import("./store.js").Store} store
 */
export function notify(store, level, text) {
  const known = level in NOTICE_STAYS ? level : "info";
  const notice = { id: (notify.last = (notify.last ?? 0) + 1), level: known, text: String(text).slice(0, 500) };
  const others = store.state.notices.filter((other) => other.text !== notice.text);
  store.update({ notices: [...others, notice].slice(-MOST_NOTICES) });
}
