"""Lists of recorded trials: for `hindsight sessions`, the review page and the analysis."""

import re
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import msgspec

from app.recording.container import scan
from app.recording.entry import TrialEntry, make_entry, read_entry
from app.recording.errors import RecordingError
from app.recording.folders import RAW_PATTERN
from app.recording.locks import is_locked
from app.recording.messages import decode_header
from app.recording.numbering import FINISHED, UNFINISHED
from app.recording.schema import TrialHeader

_PLACE = re.compile(
    r"/(?P<study>[^/]+)/data/raw/subject-(?P<participant>[^/]+)/session-(?P<session>[^/]+)/[^/]+$"
)


def list_trials(root: Path | str, study: str | None = None) -> list[TrialEntry]:
    """All trials below the folder of sessions, by study, participant, session and trial.

    Finished trials come from the index record inside each file, without reading its steps.
    Unfinished ones are "running" while a living process writes them, else "interrupted". A file
    that cannot be used is listed with its problem.

    Args:
        root: The folder of all sessions.
        study: Only this study.

    Raises:
        RecordingError: If the folder does not exist.
    """
    base = Path(root)
    if not base.is_dir():
        raise RecordingError(f"there is no folder of sessions at {base}")
    entries = [entry_of(path) for path in _logs(base, study)]
    return sorted(entries, key=lambda e: (e.study, e.participant, e.session, e.trial, e.path))


def _logs(base: Path, study: str | None) -> Iterator[Path]:
    for folder in base.glob(f"{study or '*'}/{RAW_PATTERN}"):
        for path in folder.iterdir():
            if path.name.endswith((FINISHED, UNFINISHED)) and not path.name.startswith("."):
                yield path


def entry_of(path: Path) -> TrialEntry:
    """The entry of one log, finished or not; never raises for what is in the file.

    A log whose header a newer program wrote has a problem, however well its index reads: its steps
    need not.
    """
    try:
        header = read_header(path)
        if path.name.endswith(FINISHED):
            entry = read_entry(path)
            return entry if header else _unusable(path, f"{path} holds no trial")
    except RecordingError as error:
        return _unusable(path, str(error))
    if header is None:
        return _unusable(path, f"{path} holds nothing yet")
    entry = make_entry(path, header, None)
    return msgspec.structs.replace(entry, outcome="running" if is_locked(path) else "interrupted")


def read_header(path: Path) -> TrialHeader | None:
    """The header of a log that may be unfinished; None where there is none.

    Raises:
        RecordingError: If the header is there and cannot be used.
    """
    try:
        with open(path, "rb") as file:
            for record, _, _, data in scan(file):
                return decode_header(data) if record == "trial" else None
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None
    except Exception:  # whatever mcap meets at a tear: see container.scan
        return None
    return None


def _unusable(path: Path, problem: str) -> TrialEntry:
    """Where the file lies still tells whose trial it was."""
    entry = TrialEntry(path=str(path), problem=problem)
    place = _PLACE.search(path.absolute().as_posix())
    return msgspec.structs.replace(entry, **place.groupdict()) if place else entry


_HEADINGS = (
    *("study", "participant", "session", "trial", "method", "target", "outcome"),
    *("time", "input", "date"),
)
_RIGHT = {"trial", "time", "input"}


def format_trials(entries: Sequence[TrialEntry]) -> str:
    """A table for the terminal: one line a trial, then the problems."""
    if not entries:
        return "No trials recorded."
    rows = [_HEADINGS, *(_row(entry) for entry in entries)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(_HEADINGS))]
    lines = ["  ".join(_cells(row, widths)).rstrip() for row in rows]
    lines += [entry.problem for entry in entries if entry.problem]
    return "\n".join(lines)


def _cells(row: Sequence[str], widths: Sequence[int]) -> Iterator[str]:
    for heading, cell, width in zip(_HEADINGS, row, widths, strict=True):
        yield cell.rjust(width) if heading in _RIGHT else cell.ljust(width)


def _row(entry: TrialEntry) -> tuple[str, ...]:
    trial = f"{entry.trial}" + (f".{entry.attempt}" if entry.attempt > 1 else "")
    ended = entry.steps > 0
    started = time.localtime(entry.started_wall_s)
    return (
        *(entry.study, entry.participant, entry.session, trial if entry.trial else "?"),
        *(entry.method, entry.instructed_goal),
        "unusable" if entry.problem else entry.outcome.replace("_", " "),
        f"{entry.duration_s:.1f} s" if ended else "–",
        f"{entry.input_s:.1f} s" if ended else "–",
        time.strftime("%Y-%m-%d %H:%M", started) if entry.started_wall_s else "–",
    )


def trials_to_json(entries: Iterable[TrialEntry]) -> str:
    """The same as JSON: a list of objects with the fields of TrialEntry."""
    return msgspec.json.format(msgspec.json.encode(list(entries))).decode()
