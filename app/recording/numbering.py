"""Names and numbers of the trial files in a session's folder."""

import os
import re
from pathlib import Path

from app.recording.errors import RecordingError
from app.recording.locks import folder_lock

FINISHED = ".mcap"
UNFINISHED = ".mcap.part"
CACHE = ".parquet"

_NAME = re.compile(r"trial-(\d{3,})\.")


def trial_name(number: int, suffix: str = FINISHED) -> str:
    """File name of a trial, `trial-001.mcap`."""
    return f"trial-{number:03d}{suffix}"


def reserve_trial(folder: Path) -> int:
    """Hand out the next free trial number of a session, once, also to several processes.

    Numbers only grow: one that was handed out and never used leaves a gap.

    Raises:
        RecordingError: If the folder is missing or cannot be written.
    """
    try:
        with folder_lock(folder) as fd:
            return reserve_locked(folder, fd)
    except OSError as error:
        raise RecordingError(f"cannot number a trial in {folder}: {error.strerror}") from None


def reserve_locked(folder: Path, lock_fd: int) -> int:
    """The same for a caller that holds the folder's lock."""
    text = os.pread(lock_fd, 32, 0)
    reserved = int(text) if text.strip().isdigit() else 0
    used = (int(m[1]) for name in os.listdir(folder) if (m := _NAME.match(name)))
    number = max(reserved, *used, 0) + 1
    os.pwrite(lock_fd, f"{number}\n".encode(), 0)
    return number
