"""The trials table as Parquet: columns and types of docs/data.md, always in the same order."""

from collections.abc import Iterable, Sequence
from typing import Any

import pyarrow as pa

from app.core.measures import MEASURE_NAMES

_TEXT, _NUMBER, _WHOLE, _FLAG = pa.string(), pa.float64(), pa.int64(), pa.bool_()
_TYPES: dict[str, Any] = {
    "study": _TEXT,
    "participant_id": _TEXT,
    "session": _WHOLE,
    "trial": _WHOLE,
    "attempt": _WHOLE,
    "part": _TEXT,
    "method": _TEXT,
    "shown_as": _TEXT,
    "method_position": _WHOLE,
    "object": _TEXT,
    "cell": _TEXT,
    "seed": _WHOLE,
    "scene": _TEXT,
    "world": _TEXT,
    "outcome": _TEXT,
    "success": _FLAG,
    "counted": _FLAG,
    **dict.fromkeys(MEASURE_NAMES, _NUMBER),
    "inferred_goal": _TEXT,
    "round_trip_ms": _NUMBER,
    "late_share": _NUMBER,
    "blurs": _WHOLE,
    "drops": _WHOLE,
    "device": _TEXT,
    "user_model": _TEXT,
    "options": _TEXT,
    "file": _TEXT,
}
COLUMNS = pa.schema(list(_TYPES.items()))
WITH_CALIBRATION = COLUMNS.append(pa.field("calibration", pa.list_(_NUMBER)))
"""What partial files hold: the counts of the belief's calibration besides."""


def to_table(rows: Iterable[dict[str, Any]], *, calibration: bool) -> pa.Table:
    """Rows as a table of exactly these columns."""
    schema = WITH_CALIBRATION if calibration else COLUMNS
    wanted = [{name: row.get(name) for name in schema.names} for row in rows]
    return pa.Table.from_pylist(wanted, schema=schema)


def sort_key(row: dict[str, Any]) -> tuple[str, int, int]:
    """User, trial, method: an order that no run's timing changes."""
    return row["participant_id"], row["trial"], row["method_position"]


def ordered(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows in that order."""
    return sorted(rows, key=sort_key)
