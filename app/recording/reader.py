"""Reads finished trials: from the columnar cache where it is fresh, else from the log."""

import contextlib
from collections.abc import Sequence
from pathlib import Path

from app.recording.cache import load_cache, write_cache
from app.recording.columns import STEP_TYPES, Columns, TrialLog
from app.recording.errors import RecordingError
from app.recording.log_file import iter_steps, read_log
from app.recording.schema import StepRecord


def read_trial(path: Path | str, columns: Sequence[str] | None = None) -> TrialLog:
    """A finished trial with its steps as columns.

    Derives the cache where it is missing or stale; a folder that cannot be written only costs time.

    Args:
        path: The `.mcap` file.
        columns: Step fields wanted; all by default.

    Raises:
        RecordingError: If the file is missing, empty, torn, damaged, foreign or of a newer format,
            or a column is unknown; the message names the file and the problem.
    """
    log = Path(path)
    unknown = set(columns or ()) - STEP_TYPES.keys()
    if unknown:
        raise RecordingError(
            f"no column {', '.join(sorted(unknown))} in {log}; valid are {', '.join(STEP_TYPES)}"
        )
    trial = load_cache(log, columns)
    if trial is not None:
        return trial
    trial = read_log(log)
    with contextlib.suppress(OSError):
        write_cache(trial)
    if columns is None:
        return trial
    return trial.select(columns)


def load_columns(path: Path | str, columns: Sequence[str] | None = None) -> Columns:
    """Steps of a finished trial as columns only; errors as `read_trial`."""
    return read_trial(path, columns).steps


def read_steps(path: Path | str) -> list[StepRecord]:
    """Steps of a finished trial as records, from the log itself; errors as `read_trial`."""
    return list(iter_steps(Path(path)))
