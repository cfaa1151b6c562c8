"""Exports recorded trials for other programs: one table of trials, one of events, steps per trial.

Nothing that identifies a person leaves: clock times become dates, wall-clock columns and free text
stay behind, and the private folder is never read.
"""

import datetime
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq

from app.recording.arrow import to_table
from app.recording.columns import Columns, TrialLog
from app.recording.components import component_names
from app.recording.errors import RecordingError
from app.recording.fields import Field, fields
from app.recording.listing import TrialEntry, list_trials
from app.recording.reader import read_trial
from app.recording.schema import TrialEvent

Format = Literal["parquet", "csv"]

WITHHELD: dict[str, frozenset[str]] = {
    "trial": frozenset({"started_wall_s"}),
    "step": frozenset({"wall_s"}),
    "event": frozenset({"wall_s"}),
    "summary": frozenset({"ended_wall_s"}),
}
"""Record → fields that are not exported: they tell when somebody sat at the screen."""

FREE_TEXT_EVENTS = frozenset({"note"})
"""Events whose detail somebody typed; it may say anything of anybody."""

_DATE = Field(
    record="trial",
    name="date",
    type="text",
    shape="",
    unit="",
    frame="",
    description="Day on which the trial was recorded, UTC.",
)


class Export(msgspec.Struct, frozen=True, kw_only=True):
    """What an export wrote."""

    trials: int
    files: list[str]
    skipped: list[str]
    """Logs that are not in it, each with the reason."""


def export_trials(
    root: Path | str, out: Path | str, format: Format = "parquet", study: str | None = None
) -> Export:
    """Write all finished trials below the folder of sessions to a folder of tables.

    `trials`, `events`, and `steps/<study>_<participant>_<session>_trial-001`, with the data
    dictionary beside them as CSV and JSON. In CSV a list is a column per component, named after
    what it is of (`belief.glass`); in Parquet it is a fixed-size list.

    Args:
        root: The folder of all sessions.
        out: Folder to write to; made where it is missing.
        format: "parquet" or "csv".
        study: Only this study.

    Raises:
        RecordingError: If the format is unknown, there are no sessions, or `out` cannot be written.
    """
    if format not in _WRITERS:
        raise RecordingError(f"no export format {format!r}; valid are {', '.join(_WRITERS)}")
    target = Path(out)
    skipped: list[str] = []
    trials: list[dict[str, Any]] = []
    events: list[dict[str, Any]] = []
    try:
        (target / "steps").mkdir(parents=True, exist_ok=True)
        files: list[Path] = []
        for log in _logs(list_trials(root, study), skipped):
            name = _name(log)
            path = target / "steps" / f"{name}.{format}"
            _write(format, _step_table(log, format), path)
            files.append(path)
            trials.append({"log": name} | _trial_row(log))
            events += [{"log": name} | _event_row(event) for event in log.events]
        for title, rows in (("trials", trials), ("events", events)):
            if rows:
                path = target / f"{title}.{format}"
                _write(format, pa.Table.from_pylist(rows), path)
                files.append(path)
        files += _write_dictionary(target)
    except OSError as error:
        raise RecordingError(f"cannot write the export to {target}: {error.strerror}") from None
    return Export(trials=len(trials), files=[str(path) for path in files], skipped=skipped)


def exported_fields() -> tuple[Field, ...]:
    """The data dictionary of an export."""
    kept = (line for line in fields() if line.name not in WITHHELD[line.record])
    return (_DATE, *kept)


def _logs(entries: list[TrialEntry], skipped: list[str]) -> Iterator[TrialLog]:
    for entry in entries:
        path = Path(entry.path)
        if entry.problem or path.suffix != ".mcap":
            skipped.append(entry.problem or f"{path} is not finished")
            continue
        try:
            log = read_trial(path)
        except RecordingError as error:
            skipped.append(str(error))
            continue
        yield log


def _name(log: TrialLog) -> str:
    header = log.header
    return f"{header.study}_{header.participant}_{header.session}_trial-{header.trial:03d}"


def _trial_row(log: TrialLog) -> dict[str, Any]:
    started = datetime.datetime.fromtimestamp(log.header.started_wall_s, datetime.UTC)
    row: dict[str, Any] = {"date": started.date().isoformat()}
    row |= _kept("trial", log.header)
    if log.summary is not None:
        row |= _kept("summary", log.summary)
    # A list in one cell of a table of trials is JSON text, in CSV and Parquet alike.
    return {
        name: msgspec.json.encode(value).decode() if isinstance(value, list) else value
        for name, value in row.items()
    }


def _event_row(event: TrialEvent) -> dict[str, Any]:
    row = _kept("event", event)
    return row | {"detail": ""} if event.name in FREE_TEXT_EVENTS else row


def _kept(record: str, struct: msgspec.Struct) -> dict[str, Any]:
    known = msgspec.structs.asdict(struct)
    return {name: value for name, value in known.items() if name not in WITHHELD[record]}


def _step_table(log: TrialLog, format: Format) -> pa.Table:
    steps = {n: column for n, column in log.steps.items() if n not in WITHHELD["step"]}
    return to_table(_spread(steps, log) if format == "csv" else steps)


def _spread(steps: Columns, log: TrialLog) -> Columns:
    """Lists as a column per component: CSV knows no lists."""
    spread: Columns = {}
    for name, column in steps.items():
        if column.ndim == 1:
            spread[name] = column
            continue
        for index, part in enumerate(component_names(name, column.shape[1], log.header)):
            spread[f"{name}.{part}"] = np.ascontiguousarray(column[:, index])
    return spread


def _write(format: Format, table: pa.Table, path: Path) -> None:
    partial = path.with_name(f".{path.name}.partial")
    try:
        _WRITERS[format](table, partial)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def _write_parquet(table: pa.Table, path: Path) -> None:
    pq.write_table(table, path, compression="zstd")


def _write_csv(table: pa.Table, path: Path) -> None:
    pa_csv.write_csv(table, path)


_WRITERS: dict[str, Callable[[pa.Table, Path], None]] = {
    "parquet": _write_parquet,
    "csv": _write_csv,
}


def _write_dictionary(target: Path) -> list[Path]:
    lines = [msgspec.structs.asdict(line) for line in exported_fields()]
    as_csv, as_json = target / "data_dictionary.csv", target / "data_dictionary.json"
    pa_csv.write_csv(pa.Table.from_pylist(lines), as_csv)
    as_json.write_bytes(msgspec.json.format(msgspec.json.encode(lines)) + b"\n")
    return [as_csv, as_json]
