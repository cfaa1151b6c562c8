"""What a list of trials shows of one trial, kept inside its file as a metadata record.

MCAP's summary section points at metadata records, so a few small reads find it,
whatever the file's length: a thousand trials list in a fraction of a second without any index
beside the files that could go stale.
"""

import os
from io import BytesIO
from pathlib import Path
from typing import Any

import msgspec
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Footer, Metadata, MetadataIndex, SummaryOffset

from app.recording.container import INDEX_RECORD, MAGIC
from app.recording.errors import RecordingError
from app.recording.log_file import readable, unfinished
from app.recording.schema import TrialHeader, TrialSummary


class TrialEntry(msgspec.Struct, frozen=True, kw_only=True):
    """One line of a list of trials."""

    path: str
    """Of the log, `.mcap` or `.mcap.part`."""
    study: str = ""
    participant: str = ""
    session: str = ""
    trial: int = 0
    attempt: int = 1
    instructed_goal: str = ""
    method: str = ""
    shown_as: str = ""
    scene: str = ""
    seed: int = 0
    started_wall_s: float = 0.0
    outcome: str = ""
    """An Outcome; "running" while a living process writes the file."""
    duration_s: float = 0.0
    input_s: float = 0.0
    steps: int = 0
    recovered: bool = False
    problem: str = ""
    """Why the file cannot be used; empty where it can."""


_NAMES = tuple(info.name for info in msgspec.structs.fields(TrialEntry))

_FOOTER_SIZE = 9 + 20 + len(MAGIC)


def make_entry(path: Path, header: TrialHeader, summary: TrialSummary | None) -> TrialEntry:
    """The entry of a trial; without a summary what the header tells."""
    known: dict[str, Any] = msgspec.structs.asdict(header)
    if summary is not None:
        known |= msgspec.structs.asdict(summary)
    known["path"] = str(path)
    return TrialEntry(**{name: known[name] for name in _NAMES if name in known})


def index_of(header: TrialHeader, summary: TrialSummary) -> dict[str, str]:
    """The entry as an MCAP metadata record holds it: text by name."""
    entry = msgspec.structs.asdict(make_entry(Path(), header, summary))
    return {n: str(v) for n, v in entry.items() if n not in ("path", "problem")}


def read_entry(path: Path) -> TrialEntry:
    """The entry stored in a finished log.

    Raises:
        RecordingError: If the file is unfinished, foreign, or cannot be read.
    """
    with readable(path):
        index = _read_index(path)
    known = {name: index[name] for name in _NAMES if name in index}
    known |= {"path": str(path), "recovered": known.get("recovered", "").lower()}
    try:
        return msgspec.convert(known, TrialEntry, strict=False)
    except msgspec.ValidationError as error:
        raise RecordingError(f"{path} has a bad index record: {error}") from None


def _read_index(path: Path) -> dict[str, str]:
    fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        size = os.fstat(fd).st_size
        tail = os.pread(fd, _FOOTER_SIZE, max(0, size - _FOOTER_SIZE))
        if size < _FOOTER_SIZE or not tail.endswith(MAGIC):
            raise RecordingError(unfinished(path, os.pread(fd, len(MAGIC), 0)))
        try:
            footer = Footer.read(_stream(tail[9:]))
            offsets = _slice(fd, footer.summary_offset_start, size - _FOOTER_SIZE)
            index = _metadata_index(fd, offsets)
            if index is not None:
                record = _slice(fd, index.offset + 9, index.offset + index.length)
                return Metadata.read(_stream(record)).metadata
        except Exception as error:  # a damaged summary may lead anywhere
            raise RecordingError(f"{path} is damaged: {error!r}") from None
        raise RecordingError(f"{path} is an MCAP file without a Hindsight trial")
    finally:
        os.close(fd)


def _metadata_index(fd: int, offsets: bytes) -> MetadataIndex | None:
    """Our record among the metadata that the summary offsets point at."""
    stream = _stream(offsets)
    while stream.count < len(offsets):
        _, length = stream.read1(), stream.read8()
        offset = SummaryOffset.read(_stream(stream.read(length)))
        if offset.group_opcode != Opcode.METADATA_INDEX:
            continue
        group = _slice(fd, offset.group_start, offset.group_start + offset.group_length)
        indices = _stream(group)
        while indices.count < len(group):
            _, length = indices.read1(), indices.read8()
            index = MetadataIndex.read(_stream(indices.read(length)))
            if index.name == INDEX_RECORD:
                return index
    return None


def _slice(fd: int, start: int, end: int) -> bytes:
    # A damaged footer may point anywhere: mcap then meets the end of the slice.
    return os.pread(fd, max(0, min(end - start, 1 << 20)), start)


def _stream(data: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(data))
