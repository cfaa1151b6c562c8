"""An export holds every finished trial, every bit of its numbers, and nothing of the person."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from app.recording.errors import RecordingError
from app.recording.export import WITHHELD, export_trials
from app.recording.reader import read_trial
from app.recording.schema import StepRecord, TrialEvent
from app.recording.store import open_session
from app.recording.writer import TrialWriter
from tests.recording.samples import make_header, make_step, make_summary

NAME = "demo_p0001_s1_trial-001"


@pytest.fixture
def sessions(tmp_path: Path, record: Callable[..., Path]) -> Path:
    """One finished trial, one that is torn."""
    root = tmp_path / "sessions"
    folder = open_session(root, "demo", "p0001", "s1")
    record(folder)
    (folder / "trial-002.mcap").write_bytes(b"torn")
    return root


def _rows(path: Path) -> list[dict[str, str]]:
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def test_csv_keeps_every_bit(sessions: Path, tmp_path: Path, steps: list[StepRecord]) -> None:
    """One column a component, named after what it is of."""
    done = export_trials(sessions, tmp_path / "out", format="csv")
    assert done.trials == 1
    assert len(done.skipped) == 1 and "trial-002.mcap" in done.skipped[0]
    rows = _rows(tmp_path / "out" / "steps" / f"{NAME}.csv")
    assert len(rows) == len(steps)
    for row, step in zip(rows, steps, strict=True):
        assert float(row["belief.cup"]) == step.belief[1]
        assert float(row["executed_twist.wz"]) == step.executed_twist[5]
        assert float(row["object_poses.bowl_qw"]) == step.object_poses[17]
        assert float(row["joint_positions_rad.joint7"]) == step.joint_positions_rad[6]
        assert float(row["finger_positions_m.1"]) == step.finger_positions_m[1]
        assert row["phase"] == step.phase
    (trial,) = _rows(tmp_path / "out" / "trials.csv")
    assert trial["log"] == NAME
    assert trial["outcome"] == "grasped" and trial["date"] == "2025-06-15"
    assert json.loads(trial["goal_names"]) == ["glass", "cup", "bowl"]


def test_parquet_holds_the_columns_of_the_log(sessions: Path, tmp_path: Path) -> None:
    """Fixed-size lists, one row a step."""
    export_trials(sessions, tmp_path / "out")
    table = pq.read_table(tmp_path / "out" / "steps" / f"{NAME}.parquet")
    log = read_trial(sessions / "demo/data/raw/subject-p0001/session-s1/trial-001.mcap")
    expected = [n for n, c in log.steps.items() if n not in WITHHELD["step"] and c.size]
    assert table.column_names == expected
    np.testing.assert_array_equal(np.array(table["belief"].to_pylist()), log.steps["belief"])
    assert table["device"].to_pylist() == log.steps["device"].tolist()


@pytest.mark.parametrize("format", ["csv", "parquet"])
def test_the_dictionary_describes_every_exported_column(
    sessions: Path, tmp_path: Path, format: str
) -> None:
    """And nothing that is not exported."""
    out = tmp_path / "out"
    export_trials(sessions, out, format="csv" if format == "csv" else "parquet")
    lines = _rows(out / "data_dictionary.csv")
    assert json.loads((out / "data_dictionary.json").read_text()) == lines
    described = {line["name"] for line in lines}
    columns: set[str] = set()
    for path in out.rglob(f"*.{format}"):
        if path.stem == "data_dictionary":
            continue
        names = list(_rows(path)[0]) if format == "csv" else pq.read_schema(path).names
        columns |= {name.split(".")[0] for name in names}
    assert columns - {"log"} == described


def test_nothing_tells_who_or_at_what_hour(tmp_path: Path) -> None:
    """No wall clock, no typed text."""
    folder = open_session(tmp_path / "sessions", "demo", "p0001", "s1")
    writer = TrialWriter(folder, make_header())
    writer.write(make_step(0))
    for name in ("note", "settings"):
        detail = f'{{"text":"{name} of Jane Doe"}}'
        event = TrialEvent(time_s=0.0, wall_s=1.75e9, step=0, name=name, detail=detail)
        writer.write_event(event)
    writer.close(make_summary())
    out = tmp_path / "out"
    export_trials(tmp_path / "sessions", out, format="csv")
    text = "".join(path.read_text() for path in out.rglob("*.csv"))
    assert "note of Jane Doe" not in text and "settings of Jane Doe" in text
    assert "wall_s" not in text and "17500000" not in text


def test_an_unknown_format_names_the_valid_ones(sessions: Path, tmp_path: Path) -> None:
    """Before anything is written."""
    unknown: str = "xlsx"
    with pytest.raises(RecordingError, match="'xlsx'; valid are parquet, csv"):
        export_trials(sessions, tmp_path / "out", format=unknown)  # pyright: ignore[reportArgumentType]
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_is_named(sessions: Path, tmp_path: Path) -> None:
    """As an error of the program, not of the operating system."""
    (tmp_path / "out").write_text("a file")
    with pytest.raises(RecordingError, match="cannot write the export"):
        export_trials(sessions, tmp_path / "out")
