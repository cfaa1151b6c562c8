"""Where logs go: room, speed, and what earlier runs left torn."""

import os
import shutil
import statistics
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from app.doctor.finding import Finding
from app.recording.folders import RAW_PATTERN
from app.recording.listing import entry_of
from app.recording.locks import is_locked
from app.recording.numbering import FINISHED, UNFINISHED

HOUR_BYTES = 200 * 10**6
"""[byte] What an hour of one session writes, logs and columns, rounded up."""
LITTLE_HOURS, TOO_LITTLE_HOURS = 20, 1
BLOCK_BYTES = 16 * 1024
"""[byte] About what a log forces to the disk five times a second."""
BLOCKS = 20
SLOW_S, TOO_SLOW_S = 0.05, 0.2
"""A log is forced to the disk every 0.2 s; beyond it more than 0.25 s would be lost [s]."""
BULK_BYTES = 8 * 2**20
CLOCK_S = 2.0
_SET_ASIDE = ("*.mcap.damaged*", "*.mcap.unreadable*")


def check_storage(sessions: Path) -> Iterator[Finding]:
    """Room, speed and clock of the disk below the folder of sessions."""
    place = _existing(sessions)
    usage = shutil.disk_usage(place)
    hours = usage.free / HOUR_BYTES
    text = f"{usage.free / 1e9:.1f} GB free at {place}, {hours:.0f} hours of sessions"
    advice = "free some, or choose another folder with --sessions"
    level = "bad" if hours < TOO_LITTLE_HOURS else "warn" if hours < LITTLE_HOURS else "ok"
    yield Finding("Disk space", level, text, "" if level == "ok" else advice)
    try:
        yield from _written(place)
    except OSError as error:
        text = f"{place} cannot be written: {error.strerror}"
        advice = "give this account the right to write there, or choose another with --sessions"
        yield Finding("Write speed", "bad", text, advice)


def check_logs(sessions: Path) -> Finding:
    """Logs that a killed process left, that cannot be read, or that were set aside as damaged."""
    found = sorted(sessions.glob(f"*/{RAW_PATTERN}/trial-*{UNFINISHED}"))
    torn = [path for path in found if not is_locked(path)]
    aside = [p for name in _SET_ASIDE for p in sessions.glob(f"*/{RAW_PATTERN}/{name}")]
    running = f", {len(found) - len(torn)} being written now" if len(found) > len(torn) else ""
    if torn:
        text = f"{len(torn)} torn{running}, the first is {torn[0]}"
        return Finding("Logs", "warn", text, "the next `hindsight run` completes them")
    finished = sorted(sessions.glob(f"*/{RAW_PATTERN}/trial-*{FINISHED}"))
    problems = [entry.problem for entry in map(entry_of, finished) if entry.problem]
    if problems:
        text = f"{len(problems)} of {len(finished)} cannot be used{running}: {problems[0]}"
        advice = "the others are not affected; `hindsight review` lists them all with what is wrong"
        return Finding("Logs", "warn", text, advice)
    if aside:
        text = f"{len(aside)} damaged files were set aside{running}, the first is {aside[0]}"
        advice = "what was readable is in the trial beside it; delete the file once you have looked"
        return Finding("Logs", "warn", text, advice)
    return Finding("Logs", "ok", f"none torn{running}")


def _written(place: Path) -> Iterator[Finding]:
    """Write as logs are written."""
    waits: list[float] = []
    with tempfile.NamedTemporaryFile(dir=place, prefix=".doctor-") as file:
        descriptor = file.fileno()
        for _ in range(BLOCKS):
            os.write(descriptor, os.urandom(BLOCK_BYTES))
            start = time.perf_counter()
            os.fdatasync(descriptor)
            waits.append(time.perf_counter() - start)
        start = time.perf_counter()
        os.write(descriptor, os.urandom(BULK_BYTES))
        os.fdatasync(descriptor)
        speed = BULK_BYTES / (time.perf_counter() - start)
        ahead = os.fstat(descriptor).st_mtime - time.time()
    yield judge_speed(statistics.median(waits), max(waits), speed)
    if abs(ahead) > CLOCK_S:
        text = f"the disk dates files {ahead:+.0f} s from this machine's clock"
        advice = "a network disk? let both use a time server; retention goes by the files' dates"
        yield Finding("Disk clock", "warn", text, advice)


def judge_speed(median_s: float, longest_s: float, bytes_per_s: float) -> Finding:
    """What the times of forced writes mean for logs."""
    text = (
        f"{1e3 * median_s:.1f} ms to force {BLOCK_BYTES // 1024} kB to the disk (median; "
        f"{1e3 * longest_s:.0f} at most), {bytes_per_s / 1e6:.0f} MB/s"
    )
    advice = "a local disk loses less when a process is killed: choose it with --sessions"
    if median_s > TOO_SLOW_S:
        return Finding("Write speed", "bad", text, advice)
    return Finding(
        "Write speed", "warn" if median_s > SLOW_S else "ok", text, advice * (median_s > SLOW_S)
    )


def _existing(folder: Path) -> Path:
    """The folder, or the nearest one above it that exists."""
    whole = folder.absolute()
    return next(path for path in (whole, *whole.parents) if path.exists())
