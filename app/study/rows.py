"""The rows of a participant's trials, made from the protocol's events and the logs."""

import json
import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from app.core import settings_from_dict, settings_to_dict
from app.core.measures import COLUMNS, MEASURE_NAMES, compute_measures
from app.core.presets import preset
from app.recording.columns import TrialLog
from app.recording.errors import RecordingError
from app.recording.numbering import trial_name
from app.recording.reader import read_trial
from app.study.protocol import Attempt
from app.study.store import SESSION, Person, Store

KEYS = ("study", "participant_id", "session", "trial", "attempt", "part", "method", "shown_as")
TRIAL_COLUMNS = (
    *KEYS,
    *("method_position", "object", "cell", "seed", "scene", "world", "outcome", "success"),
    *("counted", *MEASURE_NAMES, "inferred_goal", "round_trip_ms", "late_share", "blurs", "drops"),
    *("device", "user_model", "options", "file"),
)
_LOG_COLUMNS = (*COLUMNS, "lateness_s", "round_trip_ms", "device")


def trial_rows(store: Store, person: Person) -> list[dict[str, Any]]:
    """Rows of all finished attempts but free practice, from the index where it has them.

    Raises:
        StorageError: If the index cannot be used.
    """
    counted = person.state.counted()
    kept = store.index.rows(person.id)
    rows = []
    for attempt in person.state.attempts:
        if attempt.started.part == "free" or not attempt.outcome:
            continue
        measured = kept.get(attempt.started.trial)
        if measured is None:
            measured = measure(store, person, attempt)
            store.index.put_row(person.id, attempt.started.trial, measured)
        is_counted = counted.get(attempt.started.index) is attempt
        outcome = "discarded" if attempt.discarded else attempt.outcome
        rows.append(
            {**identify(store, person, attempt), **measured, "outcome": outcome}
            | {"success": attempt.outcome == "grasped" and not attempt.discarded}
            | {"counted": is_counted}
        )
    return rows


def identify(store: Store, person: Person, attempt: Attempt) -> dict[str, Any]:
    """What the protocol knows of an attempt."""
    started = attempt.started
    return {
        "study": store.study.name,
        "participant_id": person.id,
        "session": SESSION,
        "trial": started.trial,
        "attempt": started.attempt,
        "part": started.part,
        "method": started.condition,
        "shown_as": started.label,
        "method_position": started.place + 1,
        "object": started.target,
        "cell": person.consent.cell + 1,
        "seed": started.seed,
        "scene": "",
        "world": "physics",
        "user_model": "",
    }


def measure(store: Store, person: Person, attempt: Attempt) -> dict[str, Any]:
    """What the log tells; empty measures where it is missing or unreadable."""
    path = person.folder / trial_name(attempt.started.trial)
    try:
        log = read_trial(path, columns=_LOG_COLUMNS)
    except (RecordingError, OSError):
        return {"file": ""}
    return {**measure_log(log), "file": path.relative_to(store.root).as_posix()}


def measure_log(log: TrialLog) -> dict[str, Any]:
    """Measures, link and loop of one log; what is undefined is None."""
    header, summary, steps = log.header, log.summary, log.steps
    names = header.goal_names
    goal = names.index(header.instructed_goal) if header.instructed_goal in names else None
    measures = compute_measures(steps, true_goal=goal, dt=header.control_dt_s).to_dict()
    if summary is not None and summary.duration_s > 0.0:
        # The clock counts: a skipped tick is missing from the columns, not from the time.
        measures |= {"time_s": summary.duration_s, "input_s": summary.input_s}
    events = Counter(event.name for event in log.events)
    late = steps["lateness_s"] >= header.control_dt_s
    trips = steps["round_trip_ms"][steps["round_trip_ms"] > 0.0]
    used = Counter(str(d) for d in steps["device"] if d != "none").most_common(1)
    config = json.loads(header.config_json)
    return {
        **{name: _finite(value) for name, value in measures.items()},
        "scene": header.scene,
        "world": config.get("world", "physics"),
        "inferred_goal": summary.inferred_goal if summary is not None else "",
        "round_trip_ms": float(np.median(trips)) if len(trips) else None,
        "late_share": float(late.mean()) if len(late) else None,
        "blurs": events["blur"] + events["hidden"],
        "drops": events["disconnect"],
        "device": used[0][0] if used else "",
        "options": json.dumps(_options(config), sort_keys=True),
    }


def _options(config: dict[str, Any]) -> dict[str, Any]:
    """Settings that differ from the preset, and the study's further factors."""
    settings = config.get("settings", {})
    plain = settings_to_dict(preset("default", method=settings.get("method", "direct")))
    known = settings_to_dict(settings_from_dict(settings))
    differs = {name: value for name, value in known.items() if plain.get(name) != value}
    factors = {k: v for k, v in config.get("options", {}).items() if k not in ("part", "condition")}
    return {**differs, **factors}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def log_of(person: Person, attempt: Attempt) -> Path:
    """Where an attempt's log is."""
    return person.folder / trial_name(attempt.started.trial)
