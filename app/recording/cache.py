"""The columnar cache beside a log: a Parquet file that loads in milliseconds.

The log is the record; the cache is derived from it, may be deleted at any time, and is derived
anew where it is missing or belongs to another version of the log (size or time of change differ).
Besides the steps it holds header, events and summary, so that nothing else need be read.
"""

import contextlib
import os
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
import numpy as np

# At import, not on first use: loading it takes 0.2 s, which no control loop should meet.
import pyarrow as pa
import pyarrow.parquet as pq

from app.recording.columns import STEP_TYPES, Column, Columns, TrialLog, no_pause
from app.recording.log_file import read_log, state_of
from app.recording.numbering import CACHE
from app.recording.schema import TrialEvent, TrialHeader, TrialSummary

CACHE_VERSION = 1
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
    """Derive the cache of a finished log; arguments and errors as `read_log`, `write_cache`."""
    write_cache(read_log(log, pause))


def write_cache(trial: TrialLog) -> None:
    """Write the cache of a trial just read from its log, atomically.

    Raises:
        OSError: If the cache cannot be written.
    """
    size, changed_ns = trial.log_state
    about = _About(
        version=CACHE_VERSION,
        log_size=size,
        log_changed_ns=changed_ns,
        columns={name: column.dtype.str for name, column in trial.steps.items()},
        widths={n: column.shape[1] for n, column in trial.steps.items() if column.ndim == 2},
        header=trial.header,
        events=list(trial.events),
        summary=trial.summary,
    )
    stored = {_KEY: msgspec.msgpack.encode(about)}
    _write_table(to_table(trial.steps, stored), cache_path(trial.path))


def to_table(columns: Columns, metadata: dict[bytes, bytes] | None = None) -> pa.Table:
    """Columns as an Arrow table; lists become fixed-size lists, empty ones are left out."""
    arrays = {name: _to_arrow(column) for name, column in columns.items() if column.size}
    arrays |= {n: _to_arrow(c) for n, c in columns.items() if c.ndim == 1 and not c.size}
    table = pa.table({name: arrays[name] for name in columns if name in arrays})
    return table.replace_schema_metadata(metadata)


def _to_arrow(column: Column) -> pa.Array:
    if column.dtype.kind == "U":
        return pa.array(column.tolist(), pa.string()).dictionary_encode()
    if column.ndim == 1:
        return pa.array(column)
    return pa.FixedSizeListArray.from_arrays(pa.array(column.reshape(-1)), column.shape[1])


def _write_table(table: pa.Table, path: Path) -> None:
    """Write beside the target, then rename: a reader meets the old cache or the new one."""
    fd, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(fd, "wb") as file:
            pq.write_table(table, file, compression="zstd")
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
            stored = (file.schema_arrow.metadata or {}).get(_KEY)
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
            table = file.read([n for n in names if n in file.schema_arrow.names])
            n_steps = file.metadata.num_rows
    except (OSError, pa.ArrowException, msgspec.MsgspecError):
        return None
    return TrialLog(
        path=log,
        log_state=log_state,
        header=about.header,
        steps={name: _from_arrow(name, table, about, n_steps) for name in names},
        events=tuple(about.events),
        summary=about.summary,
    )


def _from_arrow(name: str, table: pa.Table, about: _About, n_steps: int) -> Column:
    width = about.widths.get(name)
    if name not in table.column_names:
        return np.empty((n_steps, width or 0), dtype=about.columns[name])
    array = table[name].combine_chunks()
    if width is None:
        return array.to_numpy(zero_copy_only=False).astype(about.columns[name], copy=False)
    return array.flatten().to_numpy().reshape(n_steps, width)
