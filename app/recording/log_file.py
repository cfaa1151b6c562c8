"""Reads finished logs, strictly: a file that is not whole is refused with its reason."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

from app.recording.columns import TrialLog, no_pause, to_columns
from app.recording.container import MAGIC, scan
from app.recording.errors import MessageError, RecordingError
from app.recording.messages import decode, decode_header
from app.recording.schema import StepRecord, TrialEvent, TrialHeader, TrialSummary


def unfinished(path: Path, head: bytes) -> str:
    """Say why a file without an end is no finished log, given its first bytes."""
    if not head:
        return f"{path} is empty"
    if head[: len(MAGIC)] != MAGIC[: len(head)]:
        return f"{path} is not an MCAP file"
    return f"{path} is torn: its recording did not finish, or part of it is missing"


class Reading:
    """A finished log being read: its steps one after another, and then all else that is in it.

    Attributes:
        path: The log.
        log_state: Its size [byte] and time of change [ns] before it was read.
        events: Those met so far.
        summary: How the trial ended, once met.
    """

    def __init__(self, path: Path) -> None:
        """Look at the file; raises RecordingError where that is refused."""
        self.path = path
        with readable(path):
            self.log_state = state_of(path)  # before reading: a later change makes a cache stale
        self.events: list[TrialEvent] = []
        self.summary: TrialSummary | None = None
        self._header: TrialHeader | None = None

    @property
    def header(self) -> TrialHeader:
        """What was fixed before the first step; raises RecordingError where there was none."""
        if self._header is None:
            raise RecordingError(f"{self.path} is an MCAP file without a Hindsight trial")
        return self._header

    def steps(self) -> Iterator[StepRecord]:
        """The steps, once; raises RecordingError and MessageError where the damage is met."""
        for record, data in _messages(self.path):
            if record == "step":
                yield decode(StepRecord, data)
            elif record == "trial":
                self._header = self._header or decode_header(data)
            elif record == "event":
                self.events.append(decode(TrialEvent, data))
            else:
                self.summary = decode(TrialSummary, data)


def read_log(path: Path, pause: Callable[[], None] = no_pause) -> TrialLog:
    """The whole trial from its MCAP file.

    Args:
        path: A finished log.
        pause: Called after every few steps, for a control loop in the same process.

    Raises:
        RecordingError: If the file is missing, empty, torn, damaged, foreign or of a newer format.
    """
    reading = Reading(path)
    with naming(path):
        columns = to_columns(reading.steps(), pause)
    return TrialLog(
        path=path,
        log_state=reading.log_state,
        header=reading.header,
        steps=columns,
        events=tuple(reading.events),
        summary=reading.summary,
    )


def iter_steps(path: Path) -> Iterator[StepRecord]:
    """Steps of a finished log one after another.

    Raises:
        RecordingError: As `read_log`, where the damage is met.
    """
    seen = False
    with naming(path):
        for record, data in _messages(path):
            if record == "step":
                yield decode(StepRecord, data)
            elif record == "trial":
                decode_header(data)
                seen = True
    if not seen:
        raise RecordingError(f"{path} is an MCAP file without a Hindsight trial")


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put the file's name before what is wrong with a message in it."""
    try:
        yield
    except MessageError as error:
        raise RecordingError(f"{path}: {error}") from None


def _messages(path: Path) -> Iterator[tuple[str, bytes]]:
    """Record name and JSON of every message; raises RecordingError where the file is not whole."""
    with readable(path), open(path, "rb") as file:
        head = file.read(len(MAGIC))
        file.seek(0)
        try:
            for record, _, _, data in scan(file):
                yield record, data
        except OSError:
            raise
        except Exception:  # whatever mcap meets at a tear: see container.scan
            raise RecordingError(unfinished(path, head)) from None


@contextlib.contextmanager
def readable(path: Path) -> Iterator[None]:
    """Turn the operating system's refusals to read a file into a RecordingError naming it."""
    try:
        yield
    except FileNotFoundError:
        raise RecordingError(f"{path} does not exist") from None
    except OSError as error:
        raise RecordingError(f"cannot read {path}: {error.strerror}") from None


def state_of(path: Path) -> tuple[int, int]:
    """Size [byte] and time of change [ns] of a file."""
    state = path.stat()
    return state.st_size, state.st_mtime_ns
