"""What happened when: the marks on a trial's timeline."""

from typing import Any

import msgspec
import numpy as np

from app.review.replay import Replay

LEAD_S = 0.2
"""A goal leads once it has been ahead for this long; shorter leads are noise [s]."""
_PLAIN = {
    "open": "hand opens",
    "blur": "window left",
    "handover": "a visitor takes over",
    "hidden": "page hidden",
    "disconnect": "connection drops",
    "reconnect": "connection back",
    "input_lost": "input lost",
    "input_back": "input back",
    "hold": "arm held",
    "note": "note",
}


class Mark(msgspec.Struct, frozen=True, kw_only=True):
    """One mark."""

    step: int
    kind: str
    """input, leads, method, settings, hand, outcome, or the event's own name."""
    label: str


def find_marks(replay: Replay) -> list[Mark]:
    """All marks of a trial, in order."""
    marks = [*_from_steps(replay), *_from_events(replay)]
    last = replay.n_steps - 1
    kept = {(m.step, m.kind, m.label): m for m in marks if 0 <= m.step <= last}
    return sorted(kept.values(), key=lambda mark: mark.step)


def _from_steps(replay: Replay) -> list[Mark]:
    steps, start = replay.log.steps, replay.start_step
    marks = []
    if (steps["phase"] != "ready").any():
        marks.append(Mark(step=start, kind="start", label="start"))
    pushed = np.flatnonzero((steps["phase"] == "running") & (steps["input_norm"] > 0.0))
    if len(pushed):
        marks.append(Mark(step=int(pushed[0]), kind="input", label="first input"))
    for phase, label in (("closing", "hand closes"), ("lifting", "hand lifts")):
        found = np.flatnonzero(steps["phase"] == phase)
        if len(found):
            marks.append(Mark(step=int(found[0]), kind="hand", label=label))
    return marks + _leads(replay)


def _leads(replay: Replay) -> list[Mark]:
    """Where another goal becomes the most probable one, for longer than a moment."""
    belief, running = replay.log.steps["belief"], replay.log.steps["phase"] == "running"
    rows = np.flatnonzero(running)
    if not len(rows) or belief.shape[1] < 2:
        return []
    ordered = np.sort(belief[rows], axis=1)
    leader = np.where(ordered[:, -1] > ordered[:, -2] + 1e-6, belief[rows].argmax(axis=1), -1)
    ends = np.flatnonzero(np.diff(leader)) + 1
    bounds = [0, *ends.tolist(), len(leader)]
    shortest = round(LEAD_S / replay.header.control_dt_s)
    marks, before = [], -1
    for first, end in zip(bounds[:-1], bounds[1:], strict=True):
        goal = int(leader[first])
        if goal < 0 or goal == before or end - first < shortest:
            continue
        before = goal
        label = f"leads: {replay.header.goal_names[goal]}"
        marks.append(Mark(step=int(rows[first]), kind="leads", label=label))
    return marks


def _from_events(replay: Replay) -> list[Mark]:
    marks = []
    for event in replay.log.events:
        detail: dict[str, Any] = msgspec.json.decode(event.detail) if event.detail else {}
        step, name = min(event.step, replay.n_steps - 1), event.name
        if name in _PLAIN:
            marks.append(Mark(step=step, kind=name, label=_PLAIN[name]))
        elif name == "method":
            marks.append(Mark(step=step, kind="method", label=f"method: {detail.get('method')}"))
        elif name == "assist":
            word = "on" if detail.get("enabled") else "off"
            marks.append(Mark(step=step, kind="method", label=f"assistance {word}"))
        elif name == "settings" and detail.get("why") == "settings":
            marks.append(Mark(step=step, kind="settings", label="settings change"))
        elif name == "outcome":
            label = str(detail.get("outcome", "")).replace("_", " ")
            marks.append(Mark(step=step, kind="outcome", label=label))
        elif name == "late" and detail.get("skipped", 0) >= 10:
            marks.append(Mark(step=step, kind="late", label=f"{detail['skipped']} ticks lost"))
    return marks
