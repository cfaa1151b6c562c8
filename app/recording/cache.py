"""The columnar cache beside a log: a Parquet file that loads in milliseconds.

The log is the record; the cache is derived from it, may be deleted at any time, and is derived
anew where it is missing or belongs to another version of the log (size or time of change differ).
Besides the steps it holds header, events and summary, so that nothing else need be read.
"""

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO

import msgspec
import numpy as np

# At import, not on first use: loading it takes 0.2 s, which no control loop should meet.
import pyarrow as pa
import pyarrow.parquet as pq

from app.recording.arrow import from_table, to_table
from app.recording.columns import STEP_TYPES, Column, Columns, TrialLog, no_pause, to_columns
from app.recording.log_file import Reading, naming, read_log, state_of
from app.recording.numbering import CACHE
from app.recording.schema import StepRecord, TrialEvent, TrialHeader, TrialSummary

CACHE_VERSION = 1
GROUP_STEPS = 3000
"""[step] Derived and written at once: half a minute of a trial, 5 MB."""
_KEY = b"hindsight"


class _About(msgspec.Struct, kw_only=True):
    """What the Parquet file says of itself: whose cache it is, and all that is not a step."""

    version: int
    log_size: int
    log_changed_ns: int
    columns: dict[str, str]
    """Field name → NumPy type, of every field."""
    widths: dict[str, int]
    """Length of every list field; Parquet has no lists of length 0."""
    header: TrialHeader
    events: list[TrialEvent]
    summary: TrialSummary | None


def cache_path(log: Path) -> Path:
    """Where the cache of a log is: `trial-001.parquet` beside `trial-001.mcap`."""
    return log.with_suffix(CACHE)


def derive_cache(log: Path, pause: Callable[[], None] = no_pause) -> None:
    """Derive the cache of a finished log, a group of steps after another.

    A long trial so takes no more memory than a short one. Arguments and errors as `read_log`;
    OSError if the cache cannot be written.
    """
    reading = Reading(log)
    try:
        with naming(log):
            _write(reading, _groups(reading.steps(), pause))
    except _WidthError:
        write_cache(read_log(log, pause))


def write_cache(trial: TrialLog) -> None:
    """Write the cache of a trial just read from its log, atomically.

    Raises:
        OSError: If the cache cannot be written.
    """
    _write(trial, iter([trial.steps]))


class _WidthError(Exception):
    """A list has another length than in the groups before."""


def _groups(steps: Iterator[StepRecord], pause: Callable[[], None]) -> Iterator[Columns]:
    """Columns of so many steps at a time; one group without steps where there are none."""
    group = to_columns(islice(steps, GROUP_STEPS), pause)
    yield group
    while len(group["step"]) == GROUP_STEPS:
        group = to_columns(islice(steps, GROUP_STEPS), pause)
        if len(group["step"]):
            yield group


def _write(source: TrialLog | Reading, groups: Iterator[Columns]) -> None:
    """Write the groups and then what the source knows once they have passed."""
    with _replacing(cache_path(source.path)) as file, contextlib.ExitStack() as stack:
        first = next(groups)
        types = {name: column.dtype for name, column in first.items()}
        widths = _widths(first)
        table = to_table(first)
        # Measured numbers hardly repeat: a dictionary of them costs more than it saves.
        text: Any = [f.name for f in table.schema if pa.types.is_dictionary(f.type)]
        writer = stack.enter_context(
            pq.ParquetWriter(
                file, table.schema, compression="zstd", use_dictionary=text, write_statistics=False
            )
        )
        writer.write_table(table)
        for group in groups:
            if _widths(group) != widths:
                raise _WidthError
            types = {name: np.promote_types(types[name], c.dtype) for name, c in group.items()}
            writer.write_table(to_table(group))
        size, changed_ns = source.log_state
        about = _About(
            version=CACHE_VERSION,
            log_size=size,
            log_changed_ns=changed_ns,
            columns={name: kind.str for name, kind in types.items()},
            widths=widths,
            header=source.header,
            events=list(source.events),
            summary=source.summary,
        )
        writer.add_key_value_metadata({_KEY: msgspec.msgpack.encode(about)})


def _widths(columns: Columns) -> dict[str, int]:
    return {name: column.shape[1] for name, column in columns.items() if column.ndim == 2}


@contextlib.contextmanager
def _replacing(path: Path) -> Iterator[BinaryIO]:
    """Write beside the target, then rename: a reader meets the old cache or the new one."""
    fd, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(fd, "wb") as file:
            yield file
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(name)
        raise


def load_cache(log: Path, columns: Sequence[str] | None = None) -> TrialLog | None:
    """The trial from its cache; None where the cache is missing, stale or damaged.

    Args:
        log: The `.mcap` file.
        columns: Fields wanted; all by default.
    """
    try:
        log_state = state_of(log)
        with pq.ParquetFile(cache_path(log)) as file:
            stored = (file.metadata.metadata or {}).get(_KEY)
            if stored is None:
                return None
            about = msgspec.msgpack.decode(stored, type=_About)
            fresh = log_state == (about.log_size, about.log_changed_ns)
            # A field that has joined the record since makes the cache stale as well.
            if (
                not fresh
                or about.version != CACHE_VERSION
                or about.columns.keys() != STEP_TYPES.keys()
            ):
                return None
            names = list(about.columns if columns is None else columns)
            # The step's number comes along: it tells how many rows there are.
            stored_names = {n for n in names if n in file.schema_arrow.names} | {"step"}
            table = file.read(list(stored_names))
    except (OSError, pa.ArrowException, ValueError, RecursionError):
        return None
    return TrialLog(
        path=log,
        log_state=log_state,
        header=about.header,
        steps={name: _column(name, table, about) for name in names},
        events=tuple(about.events),
        summary=about.summary,
    )


def _column(name: str, table: pa.Table, about: _About) -> Column:
    kind = about.columns[name]
    if name not in table.column_names:
        return np.empty((table.num_rows, about.widths.get(name, 0)), dtype=kind)
    return from_table(table, name).astype(kind, copy=False)
