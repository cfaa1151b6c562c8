"""Rows of the trials table derived from logs, where a folder has no table."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from app.analysis.frames import Frame, pd
from app.analysis.tables import name_some
from app.core.measures import COLUMNS, calibration_counts, compute_measures
from app.recording.columns import TrialLog
from app.recording.entry import TrialEntry
from app.recording.errors import RecordingError
from app.recording.listing import entry_of
from app.recording.reader import read_trial

N_BINS = 10
"""Bins of the calibration diagram."""

HEALTH = ("lateness_s", "round_trip_ms", "device")


def find_logs(folder: Path) -> list[TrialEntry]:
    """Entries of the logs anywhere below a folder, unusable ones included (their `problem`)."""
    found = [*folder.rglob("trial-*.mcap"), *folder.rglob("trial-*.mcap.part")]
    return [entry_of(path) for path in sorted(found)]


def rows_from_logs(folder: Path, notes: list[str], progress: Callable[[str], None]) -> Frame:
    """One row per usable log, with the columns of docs/data.md."""
    entries = find_logs(folder)
    whole = [entry for entry in entries if not entry.problem and entry.path.endswith(".mcap")]
    for entry in entries:
        if entry.problem:
            notes.append(f"{Path(entry.path).name} was left out: {entry.problem}.")
    logs = _read_all(whole, (*COLUMNS, *HEALTH), notes, progress)
    rows = [make_row(log, folder) for log in logs]
    torn = [e for e in entries if not e.problem and not e.path.endswith(".mcap")]
    if torn:
        names = name_some([_relative(Path(entry.path), folder) for entry in torn])
        notes.append(f"{len(torn)} logs were not finished and count as interrupted: {names}.")
    return pd.DataFrame([*rows, *(_interrupted_row(entry, folder) for entry in torn)])


def _interrupted_row(entry: TrialEntry, folder: Path) -> dict[str, Any]:
    """What the header of an unfinished log tells; its measures stay empty."""
    return {
        "study": entry.study,
        "participant_id": entry.participant,
        "session": entry.session,
        "trial": entry.trial,
        "attempt": entry.attempt,
        "part": "demo" if entry.study == "demo" else "recorded",
        "method": entry.method,
        "shown_as": entry.shown_as,
        "object": entry.instructed_goal,
        "seed": entry.seed,
        "scene": entry.scene,
        "outcome": "interrupted",
        "success": False,
        "counted": False,
        "time_s": float("nan"),
        "file": _relative(Path(entry.path), folder),
    }


def _relative(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.as_posix()


def make_row(log: TrialLog, folder: Path) -> dict[str, Any]:
    """The row of one log.

    Live sessions are study "demo", whose trials are all recorded ones; a study names its training
    in the header's `shown_as` or in its own table, which is read instead of this.
    """
    header, summary = log.header, log.summary
    outcome = summary.outcome if summary is not None else "interrupted"
    names = [event.name for event in log.events]
    measures = compute_measures(
        log.steps, true_goal=goal_index(log), dt=header.control_dt_s
    ).to_dict()
    if summary is not None and summary.duration_s > 0.0:
        # The clock counts: a skipped tick is missing from the columns, not from the time.
        measures |= {"time_s": summary.duration_s, "input_s": summary.input_s}
    late = log.steps["lateness_s"] >= header.control_dt_s
    round_trips = log.steps["round_trip_ms"]
    round_trips = round_trips[round_trips > 0.0]
    devices, uses = np.unique(log.steps["device"], return_counts=True)
    return {
        "study": header.study,
        "participant_id": header.participant,
        "session": header.session,
        "trial": header.trial,
        "attempt": header.attempt,
        "part": "demo" if header.study == "demo" else "recorded",
        "method": header.method,
        "shown_as": header.shown_as,
        "object": header.instructed_goal,
        "seed": header.seed,
        "scene": header.scene,
        "outcome": outcome,
        "success": outcome == "grasped",
        "counted": outcome == "grasped",
        **measures,
        "inferred_goal": summary.inferred_goal if summary is not None else "",
        "round_trip_ms": float(np.median(round_trips)) if len(round_trips) else float("nan"),
        "late_share": float(late.mean()) if len(late) else float("nan"),
        "blurs": names.count("blur"),
        "drops": names.count("disconnect"),
        "device": _main_device(devices, uses),
        "options": json.dumps({}),
        "file": _relative(log.path, folder),
    }


def goal_index(log: TrialLog) -> int | None:
    """Index of the instructed goal among the modelled ones; None where it is not modelled."""
    names = log.header.goal_names
    goal = log.header.instructed_goal
    return names.index(goal) if goal in names else None


def count_calibration(
    logs: list[tuple[str, Path]], progress: Callable[[str], None]
) -> tuple[Frame, int]:
    """Forecasts and hits of the belief by method, over the running phase of given logs.

    Args:
        logs: Method and file of each trial.
        progress: Told now and then how far it is.

    Returns:
        Table with method, low, high, count, probability_sum, hits; and how many logs entered.
    """
    totals: dict[str, np.ndarray] = {}
    used = 0
    for i, (method, path) in enumerate(logs):
        try:
            log = read_trial(path, columns=("phase", "belief"))
        except (RecordingError, OSError):
            continue
        true_goal = goal_index(log)
        running = log.steps["phase"] == "running"
        if true_goal is None or not running.any():
            continue
        counts = np.array(calibration_counts(log.steps["belief"][running], true_goal, N_BINS))
        totals[method] = totals.get(method, 0.0) + counts
        used += 1
        if i % 50 == 49:
            progress(f"belief of {i + 1} of {len(logs)} logs")
    edges = np.linspace(0.0, 1.0, N_BINS + 1)
    rows = [
        (method, edges[k], edges[k + 1], *totals[method][:, k])
        for method in totals
        for k in range(N_BINS)
    ]
    names = ["method", "low", "high", "count", "probability_sum", "hits"]
    return pd.DataFrame(rows, columns=pd.Index(names)), used


def _read_all(
    entries: list[TrialEntry],
    columns: tuple[str, ...],
    notes: list[str],
    progress: Callable[[str], None],
) -> Iterator[TrialLog]:
    for i, entry in enumerate(entries):
        try:
            yield read_trial(Path(entry.path), columns=columns)
        except (RecordingError, OSError) as error:
            notes.append(f"{Path(entry.path).name} was left out: {error}.")
        if i % 50 == 49:
            progress(f"{i + 1} of {len(entries)} logs read")


def _main_device(devices: np.ndarray, uses: np.ndarray) -> str:
    """The device used longest, other than none."""
    used = [(int(n), str(name)) for name, n in zip(devices, uses, strict=True) if name != "none"]
    return max(used)[1] if used else ""
