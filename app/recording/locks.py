"""File locks: which log a living process still writes, and who may hand out trial numbers.

`flock` belongs to the open file, so the kernel drops it when its process dies, however it dies.
"""

import contextlib
import fcntl
import os
import time
from collections.abc import Iterator
from pathlib import Path

LOCK_NAME = ".trials.lock"
"""In every session's folder; holds the highest trial number handed out."""


def lock(fd: int) -> None:
    """Take the exclusive lock of an open file nobody else keeps."""
    fcntl.flock(fd, fcntl.LOCK_EX)


def try_lock(fd: int) -> bool:
    """Take the exclusive lock of an open file unless another holder keeps it.

    Asks a few times: `is_locked` in another process holds the lock for microseconds.
    """
    for _ in range(5):
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(0.005)
        else:
            return True
    return False


def is_locked(path: Path) -> bool:
    """Whether a living process holds the file's lock; False where there is no such file."""
    try:
        fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        return False
    try:
        fcntl.flock(fd, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(fd)
    return False


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[int]:
    """Hold a session folder's lock while trial files are created, numbered or recovered.

    Yields:
        The lock file's descriptor, open for reading and writing.
    """
    fd = os.open(folder / LOCK_NAME, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        fcntl.flock(fd, fcntl.LOCK_EX)
        yield fd
    finally:
        os.close(fd)
