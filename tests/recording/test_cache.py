"""The cache tells what the log tells, and is never trusted beyond it."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from app.recording.cache import cache_path, load_cache
from app.recording.columns import STEP_TYPES, same_columns, to_columns
from app.recording.log_file import read_log
from app.recording.reader import load_columns, read_steps, read_trial
from app.recording.writer import TrialWriter
from tests.recording.samples import make_header, make_step, make_summary


def test_the_cache_equals_the_log(record: Callable[..., Path]) -> None:
    """Header, events, summary and every bit of every column."""
    path = record()
    cached, log = load_cache(path), read_log(path)
    assert cached is not None
    assert same_columns(cached.steps, log.steps)
    assert list(cached.steps) == list(STEP_TYPES)
    assert (cached.header, cached.events, cached.summary) == (log.header, log.events, log.summary)
    for name, column in cached.steps.items():
        assert column.dtype == log.steps[name].dtype, name


def test_lists_are_fixed_size_lists_for_other_programs(record: Callable[..., Path]) -> None:
    """The Parquet file reads as a table with one row a step."""
    table = pq.read_table(cache_path(record()))
    assert str(table.schema.field("belief").type).startswith("fixed_size_list")
    assert table.num_rows == 50


def test_a_missing_cache_is_derived_on_reading(record: Callable[..., Path]) -> None:
    """Deleting it costs time only."""
    path = record()
    before = read_trial(path)
    cache_path(path).unlink()
    assert same_columns(read_trial(path).steps, before.steps)
    assert load_cache(path) is not None


@pytest.mark.parametrize("damage", [b"", b"PAR1 not a table PAR1", b"\0" * 4096])
def test_a_damaged_cache_is_replaced(record: Callable[..., Path], damage: bytes) -> None:
    """The log is the record."""
    path = record()
    cache_path(path).write_bytes(damage)
    assert load_cache(path) is None
    assert read_trial(path).n_steps == 50
    assert load_cache(path) is not None


def test_a_stale_cache_is_not_believed(record: Callable[..., Path], tmp_path: Path) -> None:
    """Another log under the same name, even of the same size, has another time of change."""
    path = record(tmp_path)
    state = path.stat()
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns + 1))
    assert load_cache(path) is None
    other = record(tmp_path / "other", seed=1234)
    os.replace(other, path)
    assert read_trial(path).header.seed == 1234
    cached = load_cache(path)
    assert cached is not None and cached.header.seed == 1234


def test_some_columns_are_those_columns(record: Callable[..., Path]) -> None:
    """In the order asked for, from cache and log alike."""
    path = record()
    wanted = ["belief", "time_s", "phase"]
    cached = load_columns(path, wanted)
    cache_path(path).unlink()
    assert list(cached) == wanted
    assert same_columns(cached, load_columns(path, wanted))


def test_a_trial_without_a_step_has_empty_columns(tmp_path: Path) -> None:
    """Aborted before the first tick."""
    writer = TrialWriter(tmp_path, make_header())
    path = writer.close(make_summary())
    writer.join()
    assert path is not None
    cached = load_cache(path)
    assert cached is not None and cached.n_steps == 0
    assert same_columns(cached.steps, read_log(path).steps)
    assert read_steps(path) == []


def test_lists_that_are_empty_or_vary_keep_their_rows(tmp_path: Path) -> None:
    """A world without fingers has columns of width 0; a short row ends in NaN or −1."""
    writer = TrialWriter(tmp_path, make_header())
    rows = [[1.0, 2.0], [3.0], []]
    for number, row in enumerate(rows):
        best = list(range(len(row)))
        writer.write(make_step(number, finger_positions_m=[], values=row, best_targets=best))
    path = writer.close(make_summary())
    writer.join()
    assert path is not None
    for steps in (read_trial(path).steps, to_columns(read_steps(path))):
        assert steps["finger_positions_m"].shape == (3, 0)
        np.testing.assert_array_equal(steps["values"], [[1, 2], [3, np.nan], [np.nan, np.nan]])
        np.testing.assert_array_equal(steps["best_targets"], [[0, 1], [0, -1], [-1, -1]])


@pytest.mark.parametrize("row", [[3.0, 4.0], [3.0], [3.0, 4.0, 5.0]])
def test_a_long_trial_is_derived_in_groups(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, row: list[float]
) -> None:
    """The same as in one piece, also where words grow or a list has another length later on."""
    monkeypatch.setattr("app.recording.cache.GROUP_STEPS", 4)
    writer = TrialWriter(tmp_path, make_header())
    for number in range(10):
        late = number > 6
        values, device = (row, "a longer word") if late else ([1.0, 2.0], "none")
        writer.write(make_step(number, values=values, device=device))
    path = writer.close(make_summary())
    writer.join()
    assert path is not None
    cached, log = load_cache(path), read_log(path)
    assert cached is not None and cached.summary == log.summary and cached.header == log.header
    assert same_columns(cached.steps, log.steps)
    assert [c.dtype for c in cached.steps.values()] == [c.dtype for c in log.steps.values()]
    groups = pq.ParquetFile(cache_path(path)).num_row_groups
    assert groups == (3 if len(row) == 2 else 1)


def test_deriving_and_loading_a_cache_never_imports_pandas(record: Callable[..., Path]) -> None:
    """Its import would stop a control loop in the same process for a second."""
    path = record()
    cache_path(path).unlink()
    script = (
        "import sys; from app.recording.reader import read_trial\n"
        "for _ in range(2): read_trial(sys.argv[1])\n"
        "print('pandas' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(path)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "False"
    assert load_cache(path) is not None
