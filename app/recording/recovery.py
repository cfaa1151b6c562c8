"""Completes the logs of processes that died: run when the program starts.

A log that a living process writes is locked and left alone. Of any other, all that its checksums
vouch for is kept, a summary is added, and the file gets its final name.
"""

import contextlib
import itertools
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import msgspec

from app.recording.cache import derive_cache
from app.recording.container import TrialEncoder, scan, to_ns
from app.recording.entry import index_of
from app.recording.errors import NewerFormatError, RecordingError
from app.recording.folders import RAW_PATTERN, append_event
from app.recording.locks import folder_lock, try_lock
from app.recording.log_file import readable
from app.recording.messages import decode, decode_header
from app.recording.numbering import FINISHED, UNFINISHED
from app.recording.schema import StepRecord, TrialHeader, TrialSummary
from app.recording.summarize import SummaryBuilder

TORN_BYTES = 64 * 1024
"""[byte] What a killed process can leave of a chunk. Where more cannot be read, the file was
damaged otherwise, and the whole is kept beside the recovered trial."""

Action = Literal["completed", "renamed", "running", "removed", "unreadable", "failed"]
"""completed: a summary was added to what was readable. renamed: the log was whole, only its name
was not final. running: a living process writes it. removed: it was empty. unreadable: it holds no
trial and was set aside. failed: see `problem`; the file is as it was."""


class Recovery(msgspec.Struct, frozen=True, kw_only=True):
    """What became of one unfinished log."""

    path: str
    """The log as it is called now."""
    action: Action
    steps: int = 0
    dropped_bytes: int = 0
    """At the end of the file, not readable."""
    problem: str = ""


class _Salvage(msgspec.Struct, kw_only=True):
    """What could be read of an unfinished log."""

    encoder: TrialEncoder
    header: TrialHeader | None = None
    builder: SummaryBuilder | None = None
    summary: TrialSummary | None = None
    whole: bool = False
    end: int = 0
    """[byte] Offset behind the last readable record."""


def recover_trials(root: Path | str) -> list[Recovery]:
    """Complete every unfinished log below the folder of sessions.

    What was done is also appended to each session's events.jsonl. Never raises for what is in a
    file or for a folder that cannot be written: such logs are reported as "failed".
    """
    reports: list[Recovery] = []
    for folder in sorted(Path(root).glob(f"*/{RAW_PATTERN}")):
        reports += recover_folder(folder)
    return reports


def recover_folder(folder: Path) -> list[Recovery]:
    """The same for one session's folder."""
    if not any(_unfinished(folder)):
        return []
    try:
        # No other process may open, number or recover a trial here meanwhile.
        with folder_lock(folder):
            reports = [_recover_reported(path) for path in sorted(_unfinished(folder))]
    except OSError as error:
        problem = f"cannot write to {folder}: {error.strerror}"
        return [
            Recovery(path=str(p), action="failed", problem=problem) for p in _unfinished(folder)
        ]
    for report in reports:
        if report.action != "running":
            with contextlib.suppress(RecordingError):
                append_event(folder, "recovered", msgspec.structs.asdict(report))
        if report.action in ("completed", "renamed"):
            with contextlib.suppress(OSError, RecordingError):
                derive_cache(Path(report.path))
    return reports


def _unfinished(folder: Path) -> Iterator[Path]:
    return folder.glob(f"trial-*{UNFINISHED}")


def _recover_reported(path: Path) -> Recovery:
    try:
        with readable(path):
            return _recover(path)
    except RecordingError as error:
        return Recovery(path=str(path), action="failed", problem=str(error))


def _recover(path: Path) -> Recovery:
    with open(path, "rb") as file:
        if not try_lock(file.fileno()):
            return Recovery(path=str(path), action="running")
        size = os.fstat(file.fileno()).st_size
        if size == 0:
            path.unlink()
            return Recovery(path=str(path), action="removed")
        found = _salvage(path)
        if found.header is None or found.builder is None:
            aside = _move(path, ".mcap.unreadable")
            return Recovery(path=str(aside), action="unreadable", dropped_bytes=size)
        if not found.whole:
            _rewrite(path, found, keep_original=size - found.end > TORN_BYTES)
        return Recovery(
            path=str(_move(path, FINISHED)),
            action="renamed" if found.whole else "completed",
            steps=found.builder.steps,
            dropped_bytes=0 if found.whole else size - found.end,
        )


def _salvage(path: Path) -> _Salvage:
    """Read up to the tear.

    Raises:
        RecordingError: If a newer program wrote the log: its own start will recover it.
    """
    found = _Salvage(encoder=TrialEncoder())
    with open(path, "rb") as file:
        try:
            for record, time_ns, number, data in scan(file):
                if record == "trial":
                    found.header = decode_header(data)
                    found.builder = SummaryBuilder(found.header)
                elif found.builder is None:
                    break  # nothing of ours precedes the header
                elif record == "step":
                    found.builder.add(decode(StepRecord, data))
                elif record == "summary":
                    found.summary = decode(TrialSummary, data)
                found.encoder.add(record, data, time_ns, number)
                found.end = file.tell()
            else:
                found.whole = True
        except OSError:
            raise
        except NewerFormatError as error:
            raise RecordingError(f"{path}: {error}") from None
        except Exception:  # whatever mcap or a damaged message raises: the prefix counts
            pass
    return found


def _rewrite(path: Path, found: _Salvage, keep_original: bool) -> None:
    """Replace the log by one that holds what was readable, a summary and an end."""
    assert found.header is not None and found.builder is not None
    if found.summary is None:
        found.summary = found.builder.interrupted()
        time_ns = to_ns(found.summary.ended_wall_s)
        found.encoder.add("summary", found.summary, time_ns, 0)
    found.encoder.finish(index_of(found.header, found.summary))
    fd, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(fd, "wb") as file:
            file.write(found.encoder.buffer.waiting)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(name, 0o644)
        if keep_original:
            os.link(path, _free(path, ".mcap.damaged"))
        os.replace(name, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(name)
        raise


def _move(path: Path, suffix: str) -> Path:
    """Give the log another ending, durably.

    Raises:
        RecordingError: If it shall become a finished trial and there is one of that name.
    """
    target = path.with_name(path.name.removesuffix(UNFINISHED) + suffix)
    if suffix != FINISHED:
        target = _free(path, suffix)
    elif target.exists():
        raise RecordingError(f"{path} cannot become {target.name}: that trial exists; rename one")
    path.rename(target)
    fd = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)
    return target


def _free(path: Path, suffix: str) -> Path:
    """A name of that ending which no file has."""
    stem = path.name.removesuffix(UNFINISHED)
    names = itertools.chain([stem + suffix], (f"{stem}{suffix}.{n}" for n in itertools.count(2)))
    return next(p for name in names if not (p := path.with_name(name)).exists())
