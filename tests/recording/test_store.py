"""Folders, numbers, events and lists of sessions."""

import json
import os
import string
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.recording.container import TrialEncoder
from app.recording.entry import index_of, read_entry
from app.recording.errors import RecordingError
from app.recording.folders import EVENTS_FILE
from app.recording.reader import read_steps, read_trial
from app.recording.schema import StepRecord
from app.recording.store import (
    append_event,
    entry_of,
    format_trials,
    list_trials,
    open_session,
    read_events,
    read_session,
    reserve_trial,
    session_folder,
    trials_to_json,
    update_session,
)
from app.recording.writer import TrialWriter
from tests.recording.samples import make_header, make_step, make_summary

NAMES = string.ascii_letters + string.digits + "_-"


@given(st.text(max_size=70), st.sampled_from(["study", "participant", "session"]))
def test_no_name_leaves_the_folder(name: str, kind: str) -> None:
    """A name is a plain word or an error that shows it."""
    names = {"study": "demo", "participant": "p1", "session": "s1", kind: name}
    try:
        folder = session_folder("/root", **names)
    except RecordingError as error:
        assert repr(name) in str(error) and kind in str(error)
        assert not name or len(name) > 64 or set(name) - set(NAMES) or kind == "study"
    else:
        assert os.path.normpath(folder) == str(folder)
        assert folder.parts[:2] == ("/", "root") and len(folder.parts) == 7


@pytest.mark.parametrize("study", ["private", "", "..", "a/b", "-rf", "a.b", "x" * 65])
def test_names_of_studies_that_are_refused(study: str) -> None:
    """Among them the folder that is never exported."""
    with pytest.raises(RecordingError, match="study"):
        session_folder("/root", study, "p1", "s1")


def test_a_session_says_who_and_when_and_is_joined_the_second_time(tmp_path: Path) -> None:
    """session.json is written once and added to."""
    folder = open_session(tmp_path, "demo", "p0001", "s1", {"device": "gamepad"})
    assert folder == tmp_path / "demo/data/raw/subject-p0001/session-s1"
    first = read_session(folder)
    assert (first["study"], first["participant"], first["session"]) == ("demo", "p0001", "s1")
    assert first["device"] == "gamepad" and first["created_wall_s"] > 1.7e9
    assert open_session(tmp_path, "demo", "p0001", "s1", {"device": "mouse"}) == folder
    assert read_session(folder) == first
    update_session(folder, {"completed": True})
    assert read_session(folder) == first | {"completed": True}
    assert sorted(path.name for path in folder.iterdir()) == ["session.json"]


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    """Before a trial begins, and for every writing function."""
    (tmp_path / "demo").write_text("a file")
    with pytest.raises(RecordingError, match="cannot write to .*demo"):
        open_session(tmp_path, "demo", "p0001", "s1")
    with pytest.raises(RecordingError, match="cannot number a trial in .*demo"):
        reserve_trial(tmp_path / "demo")
    with pytest.raises(RecordingError, match="cannot write to .*events"):
        append_event(tmp_path / "demo", "start")
    with pytest.raises(RecordingError, match="session.json"):
        read_session(tmp_path / "demo")


def test_events_are_appended_and_a_torn_line_is_passed_over(tmp_path: Path) -> None:
    """Each is durable when the call returns."""
    assert read_events(tmp_path) == []
    append_event(tmp_path, "consent", {"version": 2})
    append_event(tmp_path, "start")
    with open(tmp_path / EVENTS_FILE, "ab") as file:
        file.write(b'{"name":"to')
    assert [event["name"] for event in read_events(tmp_path)] == ["consent", "start"]
    assert read_events(tmp_path)[0]["version"] == 2


def test_trial_numbers_only_grow(tmp_path: Path) -> None:
    """Numbers handed out and files that exist both count."""
    assert [reserve_trial(tmp_path) for _ in range(3)] == [1, 2, 3]
    (tmp_path / "trial-007.mcap.part").touch()
    assert reserve_trial(tmp_path) == 8
    (tmp_path / "trial-007.mcap.part").unlink()
    assert reserve_trial(tmp_path) == 9


def test_processes_never_get_the_same_number(tmp_path: Path) -> None:
    """Four processes, 25 numbers each."""
    script = (
        "import sys; from pathlib import Path; from app.recording.store import reserve_trial\n"
        "print(*[reserve_trial(Path(sys.argv[1])) for _ in range(25)])"
    )
    children = [
        subprocess.Popen([sys.executable, "-c", script, str(tmp_path)], stdout=subprocess.PIPE)
        for _ in range(4)
    ]
    numbers = [int(word) for child in children for word in child.communicate()[0].split()]
    assert sorted(numbers) == list(range(1, 101))


def test_two_processes_recording_the_same_number_both_keep_their_trial(tmp_path: Path) -> None:
    """The number that is taken gives way, in the file's name and in its header."""
    script = (
        "import sys; from pathlib import Path\n"
        "from app.recording.writer import TrialWriter\n"
        "from tests.recording.samples import make_header, make_step, make_summary\n"
        "seed = int(sys.argv[2])\n"
        "writer = TrialWriter(Path(sys.argv[1]), make_header(seed=seed))\n"
        "for number in range(30): writer.write(make_step(seed + number))\n"
        "input()\n"
        "writer.close(make_summary())"
    )
    children = [
        subprocess.Popen([sys.executable, "-c", script, str(tmp_path), seed], stdin=subprocess.PIPE)
        for seed in ("0", "100")
    ]
    for child in children:
        child.communicate(b"\n")
        assert child.returncode == 0
    logs = [read_trial(tmp_path / f"trial-00{number}.mcap") for number in (1, 2)]
    assert [log.header.trial for log in logs] == [1, 2]
    assert {log.header.seed for log in logs} == {0, 100}
    for log in logs:
        expected = [make_step(log.header.seed + number) for number in range(30)]
        assert read_steps(log.path) == expected


def test_a_list_shows_every_trial_whatever_its_state(
    tmp_path: Path, record: Callable[..., Path]
) -> None:
    """Finished, running and unusable ones, in order, from the files alone."""
    first = open_session(tmp_path, "demo", "p0001", "s1")
    second = open_session(tmp_path, "study-a", "p0002", "s1")
    finished = record(first, attempt=2)
    (first / "trial-002.mcap").write_bytes(b"junk")
    writer = TrialWriter(second, make_header(study="study-a", participant="p0002"))
    writer.write(make_step(0))
    while not (entries := list_trials(tmp_path))[2:] or entries[2].problem:
        time.sleep(0.01)
    writer.close(make_summary())
    assert [(e.study, e.participant, e.session) for e in entries] == [
        ("demo", "p0001", "s1"),
        ("demo", "p0001", "s1"),
        ("study-a", "p0002", "s1"),
    ]
    junk, good, running = entries
    assert junk.problem.endswith("is not an MCAP file")
    assert (junk.participant, junk.session) == ("p0001", "s1")
    assert good == read_entry(finished)
    assert (good.outcome, good.attempt, good.duration_s, good.input_s) == ("grasped", 2, 12.5, 4.25)
    assert (running.outcome, running.problem) == ("running", "")
    assert [e.study for e in list_trials(tmp_path, "study-a")] == ["study-a"]
    table = format_trials(entries).splitlines()
    assert table[0].split() == [
        *("study", "participant", "session", "trial", "method", "target", "outcome"),
        *("time", "input", "date"),
    ]
    assert "unusable" in table[1]
    assert "1.2" in table[2] and "grasped" in table[2] and "12.5 s" in table[2]
    assert json.loads(trials_to_json(entries))[1]["outcome"] == "grasped"


def test_a_list_does_not_read_the_steps(tmp_path: Path, steps: list[StepRecord]) -> None:
    """With all steps blanked out, the entry still reads: it comes from both ends of the file."""
    path = open_session(tmp_path, "demo", "p0001", "s1") / "trial-001.mcap"
    header = make_header()
    encoder = TrialEncoder()
    encoder.add("trial", header, 0, 0)
    encoder.flush()
    begin = len(encoder.buffer.waiting)
    for number, step in enumerate(steps):
        encoder.add("step", step, 0, number)
    encoder.flush()
    end = len(encoder.buffer.waiting)
    encoder.finish(index_of(header, make_summary(steps=len(steps))))
    content = bytes(encoder.buffer.waiting)
    path.write_bytes(content)
    assert len(read_steps(path)) == len(steps)
    entry = read_entry(path)
    path.write_bytes(content[:begin] + b"\0" * (end - begin) + content[end:])
    assert list_trials(tmp_path) == [entry]
    assert not entry.problem
    with pytest.raises(RecordingError):
        read_steps(path)


def test_an_empty_folder_and_a_missing_one(tmp_path: Path) -> None:
    """Nothing recorded is not an error; no folder is."""
    assert format_trials(list_trials(tmp_path)) == "No trials recorded."
    with pytest.raises(RecordingError, match="no folder of sessions"):
        list_trials(tmp_path / "missing")


def test_an_unusable_file_anywhere_is_an_entry_with_its_problem(tmp_path: Path) -> None:
    """Also outside the layout of sessions, where nothing tells whose it was."""
    path = tmp_path / "x.mcap"
    path.write_bytes(b"")
    entry = entry_of(path)
    assert (entry.problem, entry.study) == (f"{path} is empty", "")
    assert "does not exist" in entry_of(Path("/x.mcap")).problem
