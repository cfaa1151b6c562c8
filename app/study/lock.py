"""One process at a time may write to a study's folder."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from app.study.errors import StudyError

LOCK_FILE = ".server.lock"


@contextmanager
def lock_study(sessions: Path, name: str) -> Iterator[None]:
    """Let one server at a time write to a study's folder.

    Raises:
        StudyError: If another process does already, or the folder cannot be used.
    """
    folder = sessions / name
    try:
        folder.mkdir(parents=True, exist_ok=True)
        fd = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise StudyError(f"cannot use {folder}: {error.strerror}") from None
    try:
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise StudyError(
                f"another server hosts {folder}; end it, or choose another --sessions"
            ) from None
        yield
    finally:
        os.close(fd)
