"""Flags and annotations: `trial-001.notes.json` beside the log, never in it."""

import threading
import time
from pathlib import Path

import msgspec

from app.recording.folders import write_json
from app.review.errors import ConflictError, ReviewError

SUFFIX = ".notes.json"
MAX_TEXT = 4000
MAX_MOMENTS = 200

_lock = threading.Lock()


class Moment(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An annotation of one moment."""

    step: int
    text: str


class Notes(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What reviewers wrote about one trial."""

    flag: bool = False
    text: str = ""
    moments: tuple[Moment, ...] = ()
    revision: int = 0
    """Counts the changes; a change has to name the one it was made from."""
    changed_wall_s: float = 0.0


def notes_path(log: Path) -> Path:
    """Where the notes of a log are."""
    return log.with_name(log.name.removesuffix(".part").removesuffix(".mcap") + SUFFIX)


def read_notes(log: Path) -> Notes:
    """The notes of a log; empty ones where there are none.

    Raises:
        ReviewError: If the file is damaged or cannot be read.
    """
    path = notes_path(log)
    try:
        return msgspec.json.decode(path.read_bytes(), type=Notes)
    except FileNotFoundError:
        return Notes()
    except OSError as error:
        raise ReviewError(f"cannot read {path}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise ReviewError(f"{path} is damaged: {error}") from None


def save_notes(log: Path, body: bytes) -> Notes:
    """Replace the notes of a log atomically.

    Args:
        log: Whose notes.
        body: Notes as JSON, with the revision they were made from.

    Returns:
        The notes as they are now.

    Raises:
        ConflictError: If they have changed since that revision.
        ReviewError: If the body is no notes, or the folder cannot be written.
    """
    try:
        wanted = msgspec.json.decode(body, type=Notes)
    except (ValueError, RecursionError) as error:
        raise ReviewError(f"these are no notes: {error}") from None
    if max(map(len, [wanted.text, *(m.text for m in wanted.moments)])) > MAX_TEXT:
        raise ReviewError(f"a note is longer than {MAX_TEXT} characters")
    if len(wanted.moments) > MAX_MOMENTS:
        raise ReviewError(f"{len(wanted.moments)} annotations; valid: at most {MAX_MOMENTS}")
    with _lock:
        revision = read_notes(log).revision
        if wanted.revision != revision:
            raise ConflictError(
                "these notes were changed elsewhere meanwhile; they are shown as they are now"
            )
        notes = msgspec.structs.replace(wanted, revision=revision + 1, changed_wall_s=time.time())
        try:
            write_json(notes_path(log), msgspec.to_builtins(notes))
        except OSError as error:
            raise ReviewError(f"cannot write {notes_path(log)}: {error.strerror}") from None
    return notes
