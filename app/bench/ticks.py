"""How well recorded loops kept their time, read from their logs."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app.core.types import Array
from app.recording.columns import TrialLog
from app.recording.errors import RecordingError
from app.recording.folders import RAW_PATTERN
from app.recording.numbering import FINISHED
from app.recording.reader import read_trial
from app.session.trial import CONTROL_DT_S


@dataclass(frozen=True)
class Punctuality:
    """Ticks of one or several loops.

    Attributes:
        ticks: Those that took place.
        lost: Slots that passed without one.
        told: Lost slots that the logs tell of as events.
        lateness_s: Of each tick [s], shape (ticks,).
        drift_s: Most that a trial's slots have moved against the clock [s].
    """

    ticks: int
    lost: int
    told: int
    lateness_s: Array
    drift_s: float

    @property
    def kept(self) -> float:
        """Share of all slots that had their tick."""
        return self.ticks / max(1, self.ticks + self.lost)


def read_punctuality(
    sessions: Path, begin_s: float = float("-inf"), end_s: float = float("inf")
) -> Punctuality:
    """Of all trials below a folder of sessions.

    Args:
        sessions: The folder.
        begin_s: Ticks before this are left out (monotonic clock of the machine) [s].
        end_s: Ticks after this are left out [s].
    """
    logs: list[TrialLog] = []
    for path in sorted(sessions.glob(f"*/{RAW_PATTERN}/*{FINISHED}")):
        try:
            logs.append(read_trial(path))
        except RecordingError:
            continue  # a trial of no step
    return punctuality(logs, begin_s, end_s)


def punctuality(
    logs: Iterable[TrialLog], begin_s: float = float("-inf"), end_s: float = float("inf")
) -> Punctuality:
    """Of these trials, between two times on the monotonic clock [s]."""
    lateness, lost, told, drift = [np.empty(0)], 0, 0, 0.0
    for log in logs:
        at = log.steps["monotonic_s"]
        within = (at >= begin_s) & (at <= end_s)
        if not within.any():
            continue
        at, late = at[within], log.steps["lateness_s"][within]
        skipped = skipped_slots(late)
        lateness.append(late)
        lost += int(skipped.sum())
        drift = max(drift, clock_drift(at, late, skipped))
        numbers = log.steps["step"][within]
        told += sum(
            int(json.loads(event.detail)["skipped"])
            for event in log.events
            if event.name == "late" and numbers[0] <= event.step <= numbers[-1]
        )
    every = np.concatenate(lateness)
    return Punctuality(len(every), lost, told, every, drift)


def skipped_slots(lateness_s: Array) -> Array:
    """Slots that passed whole before each tick, from its lateness [s]: see `session.pacing`."""
    return np.floor(lateness_s / CONTROL_DT_S).astype(int)


def clock_drift(at_s: Array, lateness_s: Array, skipped: Array) -> float:
    """How far a loop's slots have moved against the clock from its first second to its last [s].

    A tick's slot ends at the tick's time minus its lateness, or later where input has woken the
    loop early: of every second the latest counts.

    Args:
        at_s: When each tick began, shape (ticks,).
        lateness_s: How late it was, shape (ticks,).
        skipped: Slots lost before it, shape (ticks,).
    """
    second = round(1.0 / CONTROL_DT_S)
    slots = np.arange(len(at_s)) + np.cumsum(skipped) - skipped
    error = at_s - at_s[0] - lateness_s - CONTROL_DT_S * slots
    return abs(float(error[-second:].max() - error[:second].max()))
