"""`hindsight verify` and `hindsight export` as a person calls them."""

import msgspec
import pyarrow.parquet as pq
import pytest

from app.cli import main
from app.recording.container import TrialEncoder, to_ns
from app.recording.entry import index_of
from app.recording.log_file import iter_steps
from app.recording.reader import read_trial
from app.recording.schema import StepRecord, TrialHeader
from app.review.verify import verify_log
from tests.review.conftest import Logs, write_broken


def rewrite(logs: Logs, *, step: int | None = None, **header_changes: object) -> None:
    """Write the block's log anew, with one joint of one step, or the header, changed."""
    path = logs.path(logs.block)
    log, steps = read_trial(path), list(iter_steps(path))
    if step is not None:
        joints = list(steps[step].joint_positions_rad)
        joints[2] += 1e-12
        steps[step] = msgspec.structs.replace(steps[step], joint_positions_rad=joints)
    header: TrialHeader = msgspec.structs.replace(log.header, **header_changes)
    encoder = TrialEncoder()
    encoder.add("trial", header, to_ns(header.started_wall_s), 0)
    for number, record in enumerate(steps):
        assert isinstance(record, StepRecord)
        encoder.add("step", record, to_ns(record.wall_s), number)
    assert log.summary is not None
    encoder.add("summary", log.summary, to_ns(log.summary.ended_wall_s), 0)
    encoder.finish(index_of(header, log.summary))
    path.write_bytes(bytes(encoder.buffer.waiting))


def test_untouched_logs_are_identical(logs: Logs, capsys: pytest.CaptureFixture[str]):
    """All of them, bit for bit, and the exit code says so."""
    assert main(["verify", str(logs.root)]) == 0
    printed = capsys.readouterr().out
    for trial_id in (logs.glass, logs.block, logs.canteen):
        assert f"{trial_id}: identical" in printed
    assert "3 identical" in printed


def test_a_tampered_log_is_told_where(copied: Logs, capsys: pytest.CaptureFixture[str]):
    """A trillionth of a radian in step 120 is found in step 120; the others stay identical."""
    rewrite(copied, step=120)
    assert main(["verify", str(copied.root)]) == 1
    printed = capsys.readouterr().out
    assert f"{copied.block}: diverges at step 120: joint_positions_rad" in printed
    assert "2 identical, 1 diverges" in printed
    assert main(["verify", str(copied.path(copied.glass))]) == 0


def test_what_cannot_be_tried_is_told_why(copied: Logs, capsys: pytest.CaptureFixture[str]):
    """Torn, foreign and newer logs, another library's version, another model, no such file."""
    broken = write_broken(copied)
    assert main(["verify", str(copied.root)]) == 1
    printed = capsys.readouterr().out
    for trial_id, problem in broken.items():
        line = next(line for line in printed.splitlines() if line.startswith(trial_id))
        assert "cannot try" in line and problem in line
    versions = msgspec.json.decode(read_trial(copied.path(copied.block)).header.versions_json)
    other = msgspec.json.encode({**versions, "mujoco": "2.0"}).decode()
    rewrite(copied, versions_json=other)
    finding = verify_log(copied.path(copied.block), "block")
    assert finding.verdict == "cannot try" and "mujoco 2.0" in finding.detail
    rewrite(copied, versions_json=msgspec.json.encode(versions).decode(), model_hash="0" * 64)
    finding = verify_log(copied.path(copied.block), "block")
    assert finding.verdict == "cannot try" and "model" in finding.detail
    assert main(["verify", str(copied.root / "nowhere")]) == 2
    assert "no folder" in capsys.readouterr().err


@pytest.mark.parametrize("format", ["parquet", "csv"])
def test_export_writes_tables(
    copied: Logs, tmp_path, capsys: pytest.CaptureFixture[str], format: str
):
    """Every finished trial and the data dictionary; what was left out is named."""
    write_broken(copied)
    out = tmp_path / "tables"
    assert main(["export", str(copied.root), "--out", str(out), "--format", format]) == 0
    shown = capsys.readouterr()
    assert shown.out.startswith("3 trials") and "is torn" in shown.err
    steps = sorted((out / "steps").iterdir())
    assert len(steps) == 3 and (out / f"trials.{format}").is_file()
    dictionary = msgspec.json.decode((out / "data_dictionary.json").read_bytes())
    fields = {line["name"]: line for line in dictionary}
    assert fields["executed_twist"]["unit"] == "m/s, rad/s"
    assert fields["executed_twist"]["frame"] == "world"
    if format == "parquet":
        table = pq.read_table(out / "steps" / "pilot_p01_1_trial-001.parquet")
        log = read_trial(copied.path(copied.glass))
        assert table.column("belief").to_pylist() == log.steps["belief"].tolist()
