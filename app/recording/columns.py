"""Steps as columns: one array per field of StepRecord, with a row per step."""

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from app.recording.fields import element_type
from app.recording.schema import StepRecord, TrialEvent, TrialHeader, TrialSummary

Column = npt.NDArray[Any]
Columns = dict[str, Column]
"""Field name → array: text as `<U…`, whole numbers int64, numbers float64, flags bool; shape
(n_steps,), or (n_steps, length) for a list."""

BATCH = 8
"""[step] Read and converted at once: 0.4 ms, after which a control loop may run."""

_DTYPES: dict[type, Any] = {str: np.str_, int: np.int64, float: np.float64, bool: np.bool_}
_PADDING: dict[type, Any] = {int: -1, float: np.nan}

STEP_TYPES: dict[str, tuple[type, bool]] = {
    info.name: element_type(info.type) for info in msgspec.structs.fields(StepRecord)
}
"""Field name → (Python type of one value, whether it is a list)."""


@dataclass(frozen=True, slots=True)
class TrialLog:
    """One finished trial.

    Attributes:
        path: The log it came from.
        log_state: The log's size [byte] and time of change [ns] when it was read.
        header: What was fixed before the first step.
        steps: Columns of the steps, see `Columns`; lists are flat as in StepRecord.
        events: In the order they happened.
        summary: How it ended; None only where another program left it out.
    """

    path: Path
    log_state: tuple[int, int]
    header: TrialHeader
    steps: Columns
    events: tuple[TrialEvent, ...]
    summary: TrialSummary | None

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return len(next(iter(self.steps.values())))

    def select(self, columns: Iterable[str]) -> "TrialLog":
        """The same trial with fewer columns."""
        return dataclasses.replace(self, steps={name: self.steps[name] for name in columns})


def no_pause() -> None:
    """Work at full speed."""


def to_columns(steps: Iterable[StepRecord], pause: Callable[[], None] = no_pause) -> Columns:
    """Turn steps into columns; where a list's length varies, short rows end in NaN or −1.

    Args:
        steps: In order.
        pause: Called after every batch of steps.
    """
    parts: dict[str, list[Column]] = {name: [] for name in STEP_TYPES}
    remaining = iter(steps)
    while batch := list(islice(remaining, BATCH)):
        for name in STEP_TYPES:
            parts[name].append(_column(name, [getattr(step, name) for step in batch]))
        pause()
    return {name: _join(name, arrays) for name, arrays in parts.items()}


def _column(name: str, values: Sequence[Any]) -> Column:
    kind, is_list = STEP_TYPES[name]
    if not is_list:
        return np.array(values, dtype=_DTYPES[kind])
    width = max(map(len, values))
    if any(len(row) != width for row in values):
        values = [[*row, *[_PADDING[kind]] * (width - len(row))] for row in values]
    return np.array(values, dtype=_DTYPES[kind]).reshape(len(values), width)


def _join(name: str, arrays: list[Column]) -> Column:
    kind, is_list = STEP_TYPES[name]
    if not arrays:
        return np.empty((0, 0) if is_list else (0,), dtype=_DTYPES[kind])
    if is_list:
        width = max(array.shape[1] for array in arrays)
        arrays = [_widen(array, width, _PADDING[kind]) for array in arrays]
    return np.concatenate(arrays)


def _widen(array: Column, width: int, padding: Any) -> Column:
    missing = width - array.shape[1]
    return np.pad(array, ((0, 0), (0, missing)), constant_values=padding) if missing else array


def same_columns(a: Mapping[str, Column], b: Mapping[str, Column]) -> bool:
    """Whether two sets of columns agree in names, shapes, types and every value (NaN = NaN)."""
    return a.keys() == b.keys() and all(
        a[name].dtype.kind == b[name].dtype.kind
        and np.array_equal(a[name], b[name], equal_nan=a[name].dtype.kind == "f")
        for name in a
    )
