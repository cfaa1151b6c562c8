"""Folders of sessions: where a session's files are, and the two small files beside its trials.

<root>/<study>/data/raw/subject-<participant>/session-<session>/
    session.json  events.jsonl  trial-001.mcap  trial-001.parquet
"""

import contextlib
import os
import re
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from app.recording.errors import RecordingError

SESSION_FILE = "session.json"
EVENTS_FILE = "events.jsonl"
PRIVATE = "private"
RAW_PATTERN = "data/raw/subject-*/session-*"
"""Folders of sessions within a study's."""

_NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")


def validate_name(kind: str, name: str) -> str:
    """A study's, participant's or session's name, safe as part of a path.

    Raises:
        RecordingError: If it is anything but 1 to 64 letters, digits, - and _.
    """
    if not _NAME.fullmatch(name) or (kind == "study" and (name == PRIVATE or name[0] == "-")):
        raise RecordingError(
            f"{kind} {name!r} is no valid name: use 1 to 64 letters, digits, - and _"
            + (f"; not {PRIVATE!r}, and no - in front" if kind == "study" else "")
        )
    return name


def session_folder(root: Path | str, study: str, participant: str, session: str) -> Path:
    """Folder of one session; it need not exist.

    Raises:
        RecordingError: If one of the names is not valid.
    """
    validate_name("study", study)
    validate_name("participant", participant)
    validate_name("session", session)
    raw = Path(root) / study / "data" / "raw"
    return raw / f"subject-{participant}" / f"session-{session}"


def open_session(
    root: Path | str, study: str, participant: str, session: str, about: Mapping[str, Any] = {}
) -> Path:
    """Make a session's folder and its session.json, or join the session that is there.

    Args:
        root: The folder of all sessions.
        study: Name of the study.
        participant: Pseudonym of the participant.
        session: Name of the session.
        about: What else session.json shall say of a new session: versions, device, condition.

    Raises:
        RecordingError: If a name is not valid or the folder cannot be written.
    """
    folder = session_folder(root, study, participant, session)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Asked of the disk itself: permission bits say nothing of a full or read-only disk.
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(b"\0" * 4096)
            probe.flush()
        if not (folder / SESSION_FILE).exists():
            names = {"study": study, "participant": participant, "session": session}
            write_json(folder / SESSION_FILE, {**names, "created_wall_s": time.time(), **about})
    except OSError as error:
        raise RecordingError(f"cannot write to {folder}: {error.strerror}") from None
    return folder


def read_session(folder: Path) -> dict[str, Any]:
    """What session.json says.

    Raises:
        RecordingError: If it is missing or damaged.
    """
    path = folder / SESSION_FILE
    try:
        return msgspec.json.decode(path.read_bytes(), type=dict[str, Any])
    except OSError as error:
        raise RecordingError(f"cannot read {path}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"{path} is damaged: {error}") from None


def update_session(folder: Path, changes: Mapping[str, Any]) -> None:
    """Add to what session.json says, atomically; errors as `read_session` and `open_session`."""
    known = read_session(folder)
    try:
        write_json(folder / SESSION_FILE, {**known, **changes})
    except OSError as error:
        raise RecordingError(f"cannot write to {folder}: {error.strerror}") from None


def append_event(folder: Path, name: str, detail: Mapping[str, Any] = {}) -> None:
    """Append one event of the session to events.jsonl and force it to the disk.

    Not for the control loop: it waits for the disk. One write call a line, so that lines of
    several processes never mix.

    Raises:
        RecordingError: If the file cannot be written.
    """
    path = folder / EVENTS_FILE
    line = msgspec.json.encode({"wall_s": time.time(), "name": name, **detail}) + b"\n"
    try:
        fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o644)
        try:
            written = os.write(fd, line)
            os.fsync(fd)
        finally:
            os.close(fd)
    except OSError as error:
        raise RecordingError(f"cannot write to {path}: {error.strerror}") from None
    if written < len(line):
        raise RecordingError(f"cannot write to {path}: the disk is full")


def read_events(folder: Path) -> list[dict[str, Any]]:
    """Events of a session; a torn last line is passed over, a missing file has none."""
    events: list[dict[str, Any]] = []
    with contextlib.suppress(FileNotFoundError):
        for line in (folder / EVENTS_FILE).read_bytes().splitlines():
            with contextlib.suppress(msgspec.MsgspecError):
                events.append(msgspec.json.decode(line, type=dict[str, Any]))
    return events


def write_json(path: Path, content: Any) -> None:
    """Replace a JSON file atomically and durably; raises OSError."""
    fd, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(fd, "wb") as file:
            file.write(msgspec.json.format(msgspec.json.encode(content)) + b"\n")
            file.flush()
            os.fsync(file.fileno())
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(name)
        raise
