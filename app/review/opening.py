"""Opening a trial: from its cache where it is fresh, else from the log, and the cache is made."""

import contextlib
from pathlib import Path
from typing import Any

from app.recording.cache import load_cache, write_cache
from app.recording.columns import BATCH, TrialLog
from app.recording.log_file import read_log
from app.recording.store import entry_of
from app.review.errors import ReviewError
from app.review.jobs import Progress, Result
from app.review.meta import about
from app.review.packing import MEDIA_TYPE
from app.review.replay import Replay
from app.review.signals import Signals, make_signals


def open_trial(path: Path, progress: Progress = lambda share: None) -> TrialLog:
    """The whole trial.

    Args:
        path: A finished log.
        progress: Told how much of the log is read, where the cache has to be made.

    Raises:
        RecordingError: If the log cannot be used.
    """
    log = load_cache(path)
    if log is not None:
        return log
    expected, read = max(1, entry_of(path).steps), 0

    def count() -> None:
        nonlocal read
        read += BATCH
        progress(min(0.95, 0.95 * read / expected))

    log = read_log(path, count)
    with contextlib.suppress(OSError):  # a folder that cannot be written only costs time
        write_cache(log)
    return log


def open_job(path: str, trial_id: str, progress: Progress) -> Result:
    """The signals of a trial whose cache has to be made; runs as a job."""
    meta, signals = present(open_trial(Path(path), progress), trial_id)
    return Result(signals.pack(meta), MEDIA_TYPE)


def present(log: TrialLog, trial_id: str) -> tuple[dict[str, Any], Signals]:
    """What the page is told of a trial, and its curves.

    Raises:
        AppError: If the log holds what this program cannot make sense of.
    """
    replay = Replay(log)
    try:
        return about(replay, trial_id), make_signals(replay)
    except (ValueError, KeyError, IndexError, TypeError) as error:
        raise ReviewError(
            f"{trial_id} can be read, but not shown: {type(error).__name__}: {error}"
        ) from error
