"""A killed process loses a quarter of a second; a torn file loses what is behind the tear."""

import fcntl
import os
import signal
import statistics
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.recording.container import TrialEncoder, scan, to_ns
from app.recording.listing import list_trials
from app.recording.messages import decode
from app.recording.reader import read_steps, read_trial
from app.recording.recovery import recover_folder, recover_trials
from app.recording.schema import StepRecord
from app.recording.store import open_session, read_events
from app.recording.writer import TrialWriter
from tests.recording.samples import make_header, make_step, make_summary

PER_CHUNK = 10
N_STEPS = 60

CHILD = """
import sys, time
from pathlib import Path
from app.recording.writer import TrialWriter
from tests.recording.samples import make_header, make_step

writer = TrialWriter(Path(sys.argv[1]), make_header())
for number in range(10_000):
    step = make_step(number, monotonic_s=time.monotonic())
    writer.write(step)
    sys.stdout.write(f"{step.step} {step.monotonic_s}\\n")
    sys.stdout.flush()
    time.sleep(0.01)
"""


def _killed_recording(folder: Path) -> list[tuple[int, float]]:
    """Let a child process record, kill it, and return what it says it has written."""
    child = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(CHILD), str(folder)], stdout=subprocess.PIPE
    )
    assert child.stdout is not None
    lines = [child.stdout.readline() for _ in range(120)]
    child.send_signal(signal.SIGKILL)
    lines += child.stdout.readlines()
    child.wait()
    child.stdout.close()
    said = [line.split() for line in lines if line.endswith(b"\n")]
    return [(int(number), float(monotonic_s)) for number, monotonic_s in said]


def test_a_killed_process_loses_a_quarter_of_a_second(tmp_path: Path) -> None:
    """SIGKILL in mid-trial: all but the newest steps come back, unchanged and in order.

    The loss is the median of three kills, so that one stall of the machine does not count.
    """
    losses = []
    for number in range(3):
        folder = open_session(tmp_path, "demo", "p0001", f"s{number}")
        written = _killed_recording(folder)
        (report,) = recover_folder(folder)
        assert report.action == "completed", report
        trial = read_trial(report.path)
        assert trial.summary is not None
        assert (trial.summary.outcome, trial.summary.recovered) == ("interrupted", True)
        recovered = read_steps(report.path)
        # The kill may fall between the step's entry in the log and the line that tells of it.
        known = dict(written)
        for position, step in enumerate(recovered):
            assert step == make_step(position, monotonic_s=step.monotonic_s)
            assert known.get(position, step.monotonic_s) == step.monotonic_s
        losses.append(max(0.0, written[-1][1] - recovered[-1].monotonic_s))
    assert statistics.median(losses) <= 0.25, losses


def test_a_living_writer_is_left_alone(tmp_path: Path) -> None:
    """Recovery in another process neither touches nor reports away a running trial."""
    folder = open_session(tmp_path, "demo", "p0001", "s1")
    writer = TrialWriter(folder, make_header())
    writer.write(make_step(0))
    while not list(folder.glob("*.part")):
        time.sleep(0.01)
    script = (
        "import sys; from app.recording.recovery import recover_trials;"
        "print([r.action for r in recover_trials(sys.argv[1])])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "['running']"
    path = writer.close(make_summary())
    assert path is not None and read_steps(path) == [make_step(0)]
    assert recover_trials(tmp_path) == []


@cache
def _log() -> tuple[bytes, tuple[int, ...]]:
    """A finished log's bytes, and the offset behind each of its chunks of PER_CHUNK steps."""
    encoder = TrialEncoder()
    encoder.add("trial", make_header(), 0, 0)
    encoder.flush()
    ends = []
    for number in range(N_STEPS):
        step = make_step(number)
        encoder.add("step", step, to_ns(step.wall_s), number)
        if number % PER_CHUNK == PER_CHUNK - 1:
            start = encoder.buffer.tell()
            encoder.flush()
            # The chunk's record: opcode, length, content. Behind it stands its index.
            waiting = encoder.buffer.waiting
            ends.append(start + 9 + int.from_bytes(waiting[start + 1 : start + 9], "little"))
    encoder.add("summary", make_summary(), 0, 0)
    encoder.finish({})
    return bytes(encoder.buffer.waiting), tuple(ends)


def _recover_bytes(folder: Path, data: bytes) -> tuple[str, list[StepRecord]]:
    """Put the bytes into a folder as an unfinished log, recover it, read what it became."""
    for old in folder.iterdir():
        old.unlink()
    (folder / "trial-001.mcap.part").write_bytes(data)
    (report,) = recover_folder(folder)
    path = Path(report.path)
    steps = read_steps(path) if path.suffix == ".mcap" else []
    if path.suffix == ".mcap":
        assert read_trial(path).n_steps == len(steps) == report.steps
    assert recover_folder(folder) == []
    return report.action, steps


@settings(max_examples=80, deadline=None)
@given(offset=st.integers(0, len(_log()[0])))
def test_a_tear_anywhere_leaves_the_longest_prefix(
    tmp_path_factory: pytest.TempPathFactory, offset: int
) -> None:
    """Cut at any byte, every whole chunk before the cut comes back and nothing else."""
    data, ends = _log()
    folder = tmp_path_factory.mktemp("torn")
    action, steps = _recover_bytes(folder, data[:offset])
    whole = sum(end <= offset for end in ends)
    assert steps == [make_step(number) for number in range(whole * PER_CHUNK)]
    if offset == len(data):
        assert action == "renamed"
    elif steps:
        assert action == "completed"
    else:
        assert action in ("completed", "unreadable", "removed")


@settings(max_examples=80, deadline=None)
@given(
    offset=st.integers(8, len(_log()[0]) - 1),
    garbage=st.binary(min_size=1, max_size=64),
    truncate=st.booleans(),
)
def test_garbage_anywhere_leaves_a_true_prefix(
    tmp_path_factory: pytest.TempPathFactory, offset: int, garbage: bytes, truncate: bool
) -> None:
    """Overwritten bytes never raise, never invent a step, and cost no chunk before them."""
    data, ends = _log()
    rest = b"" if truncate else data[offset + len(garbage) :]
    folder = tmp_path_factory.mktemp("damaged")
    _, steps = _recover_bytes(folder, data[:offset] + garbage + rest)
    assert len(steps) >= PER_CHUNK * sum(end <= offset for end in ends)
    assert steps == [make_step(number) for number in range(len(steps))]


def test_a_damaged_file_is_kept_beside_what_was_recovered(tmp_path: Path) -> None:
    """Where much more than a torn chunk is unreadable, nothing is thrown away."""
    encoder = TrialEncoder()
    encoder.add("trial", make_header(), 0, 0)
    for number in range(400):
        encoder.add("step", make_step(number), 0, number)
        if number % 20 == 19:
            encoder.flush()
    data = bytearray(encoder.buffer.waiting)
    data[len(data) // 4] ^= 0xFF
    part = tmp_path / "trial-001.mcap.part"
    part.write_bytes(data)
    (report,) = recover_folder(tmp_path)
    assert report.action == "completed" and 0 < report.steps < 400
    assert (tmp_path / "trial-001.mcap.damaged").read_bytes() == data


def test_a_log_that_only_missed_its_name_keeps_its_summary(
    tmp_path: Path, record: Callable[..., Path]
) -> None:
    """Killed between the end of the file and its rename: nothing is rewritten."""
    path = record(tmp_path)
    content = path.read_bytes()
    path.rename(tmp_path / "trial-001.mcap.part")
    (report,) = recover_folder(tmp_path)
    assert report.action == "renamed"
    assert path.read_bytes() == content


def test_an_outcome_that_was_reached_is_not_interrupted(tmp_path: Path) -> None:
    """Killed after the grasp was judged: the log knows the outcome, and the times of the trial."""
    encoder = TrialEncoder()
    encoder.add("trial", make_header(), 0, 0)
    phases = ["running"] * 5 + ["closing"] * 3 + ["done"]
    for number, phase in enumerate(phases):
        outcome = "grasped" if phase == "done" else "running"
        encoder.add("step", make_step(number, phase=phase, outcome=outcome), 0, number)
    encoder.flush()
    (tmp_path / "trial-001.mcap.part").write_bytes(encoder.buffer.waiting)
    (report,) = recover_folder(tmp_path)
    summary = read_trial(report.path).summary
    assert summary is not None
    assert (summary.outcome, summary.recovered, summary.steps) == ("grasped", True, 9)
    assert summary.duration_s == make_step(4).time_s
    assert summary.input_s == make_step(4).input_s


def test_recovery_leaves_a_report(tmp_path: Path) -> None:
    """In the session's events, and in the list of trials."""
    folder = open_session(tmp_path, "demo", "p0001", "s1")
    data, ends = _log()
    (folder / "trial-001.mcap.part").write_bytes(data[: ends[2] + 5])
    assert [entry.outcome for entry in list_trials(tmp_path)] == ["interrupted"]
    recover_trials(tmp_path)
    (event,) = read_events(folder)
    assert event["name"] == "recovered"
    assert (event["action"], event["steps"], event["dropped_bytes"]) == ("completed", 30, 5)
    (entry,) = list_trials(tmp_path)
    assert (entry.outcome, entry.recovered, entry.steps) == ("interrupted", True, 30)


def test_a_newer_programs_log_is_left_to_it(tmp_path: Path) -> None:
    """A log this program cannot understand is neither cut nor moved."""
    encoder = TrialEncoder()
    encoder.add("trial", make_header(schema_version=99), 0, 0)
    encoder.flush()
    part = tmp_path / "trial-001.mcap.part"
    part.write_bytes(encoder.buffer.waiting)
    (report,) = recover_folder(tmp_path)
    assert report.action == "failed" and "99" in report.problem
    assert part.read_bytes() == encoder.buffer.waiting


def test_a_finished_trial_is_never_overwritten(tmp_path: Path, record: Callable[..., Path]) -> None:
    """A stray .part of the same number stays what and where it is."""
    path = record(tmp_path)
    content = path.read_bytes()
    (tmp_path / "trial-001.mcap.part").write_bytes(_log()[0])
    (report,) = recover_folder(tmp_path)
    assert report.action == "failed" and "exists" in report.problem
    assert path.read_bytes() == content


def test_what_recovery_writes_is_what_the_log_held(tmp_path: Path) -> None:
    """Messages are copied byte for byte, with their times and numbers."""
    data, ends = _log()
    part = tmp_path / "trial-001.mcap.part"
    part.write_bytes(data[: ends[1]])
    (report,) = recover_folder(tmp_path)
    with open(report.path, "rb") as file:
        messages = [entry for entry in scan(file) if entry[0] == "step"]
    assert [number for _, _, number, _ in messages] == list(range(2 * PER_CHUNK))
    for _, time_ns, number, content in messages:
        assert time_ns == to_ns(make_step(number).wall_s)
        assert decode(StepRecord, content) == make_step(number)
    assert not [name for name in os.listdir(tmp_path) if name.startswith(".trial-001")]


def test_a_look_at_the_lock_does_not_stop_a_recovery(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A list of trials holds an orphan's lock for a moment; the recovery waits for it."""
    part = tmp_path / "trial-001.mcap.part"
    part.write_bytes(_log()[0])
    looker = os.open(part, os.O_RDONLY)
    fcntl.flock(looker, fcntl.LOCK_SH)
    waits: list[float] = []

    def end_the_look(seconds: float) -> None:
        waits.append(seconds)
        fcntl.flock(looker, fcntl.LOCK_UN)

    monkeypatch.setattr("app.recording.locks.time", SimpleNamespace(sleep=end_the_look))
    (report,) = recover_folder(tmp_path)
    os.close(looker)
    assert (report.action, report.steps, len(waits)) == ("renamed", N_STEPS, 1)
