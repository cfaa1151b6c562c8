"""What leaves the lab: no identities, no times of day, comments only when asked for; rebuilding."""

import csv
import json
from pathlib import Path

import pytest

from app.recording.folders import EVENTS_FILE
from app.recording.numbering import reserve_trial
from app.recording.reader import read_trial
from app.recording.writer import TrialWriter
from app.study.errors import StudyError
from app.study.events import Answered, AttemptEnded, AttemptStarted
from app.study.export import export_study
from app.study.index import FILE
from app.study.load import study_path
from app.study.lock import lock_study
from app.study.rebuild import rebuild
from app.study.server.host import Host
from app.study.server.session import resolve_open
from app.study.store import Person, Store
from app.study.tables import copy_study_file, table_path, write_tables
from app.web.config import ServerConfig
from tests.recording.samples import make_event, make_header, make_step, make_summary
from tests.study.builders import BACKGROUND, DEVICE, open_store, survey_answers
from tests.study.test_store import do, join

COMMENT = "My aunt lives in Delft"
AGENT = "Mozilla/5.0 (X11; Linux x86_64) Chrome/129.0.1.2"
IDENTITY = "5f3c-prolific-person"
NOON_S = 1.75e9 // 86400 * 86400 + 43_210.5


def write_log(person: Person, trial: int, outcome: str = "grasped") -> None:
    """A short log of the number the protocol expects."""
    assert reserve_trial(person.folder) == trial
    header = make_header(
        participant=person.id, trial=trial, started_wall_s=NOON_S, config_json='{"settings":{}}'
    )
    writer = TrialWriter(person.folder, header)
    for number in range(1, 30):
        writer.write(make_step(number, wall_s=NOON_S + 0.01 * number, device="pointer"))
    writer.write_event(make_event(5))
    assert writer.close(make_summary(outcome=outcome, ended_wall_s=NOON_S + 1))


def start_trial(store: Store, person: Person) -> AttemptStarted:
    """The attempt that is due begins."""
    state, task = person.state, person.state.task
    assert task is not None
    started = AttemptStarted(
        index=state.at,
        attempt=state.next_attempt,
        trial=len(state.attempts) + 1,
        part=task.part,
        place=task.place,
        condition=task.condition,
        label=task.label,
        target=task.target,
        seed=task.seed,
    )
    store.append(person.id, started)
    return started


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study's folder with one participant who has completed it, and the server gone."""
    store = open_store(tmp_path)
    copy_study_file(store, study_path("paper"))
    person = join(store, parameters={"PROLIFIC_PID": IDENTITY})
    while person.state.is_open:
        kind = person.state.step.kind
        if person.state.task is not None:
            started = start_trial(store, person)
            write_log(person, started.trial)
            at, attempt = started.index, started.attempt
            ended = AttemptEnded(index=at, attempt=attempt, trial=started.trial, outcome="grasped")
            store.append(person.id, ended)
        elif kind == "background":
            store.append(person.id, Answered(page=kind, values=BACKGROUND))
        elif kind == "device":
            plain = {k: v for k, v in DEVICE.items() if k != "browser"}
            store.append(person.id, Answered(page=kind, values=plain))
            store.private.update(person.id, {"texts": {"device": {"browser": AGENT}}})
        elif kind == "survey":
            store.append(person.id, Answered(page="paper", values=survey_answers(store.study)))
            texts = store.private.read(person.id)["texts"]
            store.private.update(person.id, {"texts": {**texts, "paper": {"comments": COMMENT}}})
        else:
            do(store, person)
    write_tables(store)
    root = store.root
    store.close()
    return root


def test_an_export_names_nobody_and_no_time_of_day(folder: Path, tmp_path: Path):
    """Searched to the last byte, logs unpacked; the differences of times are as they were."""
    done = export_study(folder, tmp_path / "copy")
    assert (done.participants, done.trials) == (1, 8)
    files = [path for path in done.folder.rglob("*") if path.is_file()]
    held = b"\n".join(path.read_bytes() for path in files)
    for secret in (IDENTITY, COMMENT, AGENT, "Delft", "Chrome"):
        assert secret.encode() not in held
    assert not [path for path in files if "private" in path.parts or path.suffix == ".sqlite"]
    raw = done.folder / "data" / "raw" / "subject-p0001" / "session-1"
    for line in (raw / EVENTS_FILE).read_text(encoding="utf-8").splitlines():
        assert json.loads(line)["wall_s"] % 86400 == 0
    log = read_trial(raw / "trial-001.mcap")
    assert log.header.started_wall_s == NOON_S // 86400 * 86400
    assert log.steps["wall_s"][0] - log.header.started_wall_s == pytest.approx(0.01, abs=1e-4)
    assert log.summary is not None and log.summary.outcome == "grasped"
    assert len(log.steps["wall_s"]) == 29 and len(log.events) == 1
    with pytest.raises(StudyError, match="not empty"):
        export_study(folder, tmp_path / "copy")


def test_comments_are_shared_only_when_asked_for(folder: Path, tmp_path: Path):
    """In a table of their own, and with a warning."""
    done = export_study(folder, tmp_path / "copy", with_comments=True)
    (path,) = done.folder.rglob("*comments_data.csv")
    with path.open(encoding="utf-8", newline="") as file:
        assert list(csv.reader(file))[1:] == [["p0001", "paper", "comments", COMMENT]]
    assert any("identify" in note for note in done.notes)
    assert AGENT.encode() not in b"".join(p.read_bytes() for p in tmp_path.rglob("copy/**/*.csv"))


def test_index_and_tables_are_made_again_from_the_files(folder: Path):
    """The same to the byte; a folder that is being hosted is left alone."""
    tables = sorted(folder.glob("data/*.csv"))
    before = [path.read_bytes() for path in tables]
    assert [text.count(b"\n") for text in before] == [2, 10, 9]  # participants, survey, trials
    for path in [*tables, folder.parent / FILE]:
        path.unlink()
    with lock_study(folder.parent, "paper"), pytest.raises(StudyError, match="another server"):
        rebuild(folder)
    text = rebuild(folder)
    assert "1 participants, 8 attempts" in text
    assert [path.read_bytes() for path in tables] == before
    with pytest.raises(StudyError, match=r"study\.yaml"):
        rebuild(folder.parent)


@pytest.mark.parametrize("outcome", ["grasped", "knocked_over"])
def test_a_trial_whose_log_has_its_outcome_counts_though_nobody_noted_it(
    tmp_path: Path, outcome: str
):
    """The server died between the end of the log and the event; a log without one is repeated."""
    store = open_store(tmp_path)
    person = join(store)
    while person.state.task is None:
        do(store, person)
    at = person.state.at
    host = Host(store, ServerConfig(sessions=store.sessions))
    start_trial(store, person)
    resolve_open(host, person)  # nothing reached the disk
    assert person.state.attempts[-1].outcome == "interrupted" and person.state.at == at
    reserve_trial(person.folder)
    started = start_trial(store, person)
    write_log(person, started.trial, outcome)
    resolve_open(host, person)
    assert person.state.attempts[-1].outcome == outcome
    assert person.state.at == (at + 1 if outcome == "grasped" else at)
    resolve_open(host, person)
    assert len(person.state.attempts) == 2
    write_tables(store)
    with table_path(store, "trials").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["outcome"] for row in rows] == ["interrupted", outcome]
    store.close()
