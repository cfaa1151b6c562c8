"""Files are the record: state survives a kill at any event, a full disk, and a lost database."""

import errno
import os
from pathlib import Path
from typing import Any

import pytest

from app.recording.folders import EVENTS_FILE
from app.study.errors import ProtocolError, StorageError, StudyError
from app.study.events import Answered, AttemptEnded, AttemptStarted, Passed
from app.study.index import FILE, Index
from app.study.lock import lock_study
from app.study.protocol import page_name
from app.study.server.host import here
from app.study.store import Person, Store, erase_files
from app.study.tables import write_tables
from tests.study.builders import open_store, paper, survey_answers


def join(
    store: Store, name: str = "browser-0000000000", parameters: Any = None, **about: Any
) -> Person:
    """Somebody consents."""
    person, _ = store.consent(name, parameters or {}, fast=True, **about)
    return person


def do(store: Store, person: Person) -> None:
    """Whatever the step asks for."""
    state = person.state
    if state.task is not None:
        task, number = state.task, len(state.attempts) + 1
        at, attempt = state.at, state.next_attempt
        started = AttemptStarted(
            index=at,
            attempt=attempt,
            trial=number,
            part=task.part,
            place=task.place,
            condition=task.condition,
            label=task.label,
            target=task.target,
            seed=task.seed,
        )
        store.append(person.id, started)
        ended = AttemptEnded(index=at, attempt=attempt, trial=number, outcome="grasped")
        store.append(person.id, ended)
    elif state.step.kind in ("background", "device", "survey"):
        page = page_name(state.step)
        values = survey_answers(store.study) if page == "paper" else {"gender": "male"}
        store.append(person.id, Answered(page=page, values=values))
    else:
        store.append(person.id, Passed(page=here(state.step)))


def test_every_state_is_read_back_from_the_files(tmp_path: Path):
    """A new store sees, after every single event, what the old one saw; also without the index."""
    store = open_store(tmp_path)
    person = join(store)
    while person.state.is_open:
        do(store, person)
        store.close()
        (store.sessions / FILE).unlink()
        again = Store(paper(), store.sessions)
        assert again.people[person.id].state == person.state
        assert again.people[person.id].entry.token == person.entry.token
        store, person = again, again.people[person.id]
    assert person.state.status == "completed"
    store.close()


def test_the_same_request_is_the_same_participant_with_the_same_cell(tmp_path: Path):
    """Doubled consent, before and after a restart; the older cookie is worth nothing then."""
    store = open_store(tmp_path)
    first, token = store.consent("browser-0000000001", {}, fast=True)
    second, newer = store.consent("browser-0000000001", {}, fast=True)
    assert first is second and len(store.people) == 1
    assert store.by_token(f"{first.id}.{newer}") is first
    assert store.by_token(f"{first.id}.{token}") is None
    assert store.by_token("p0001.") is None and store.by_token("nobody") is None
    store.close()


def test_a_person_of_the_recruiting_platform_takes_part_once(tmp_path: Path):
    """Another browser with the same identifier is refused and sees nothing."""
    store = open_store(tmp_path)
    store.consent("browser-0000000001", {"PROLIFIC_PID": "abc"})
    with pytest.raises(ProtocolError, match="another browser"):
        store.consent("browser-0000000002", {"PROLIFIC_PID": "abc"})
    assert len(store.people) == 1
    store.close()


def test_a_code_goes_on_in_another_browser(tmp_path: Path):
    """A typed code is a secret of its holder."""
    store = open_store(tmp_path)
    first, _ = store.consent("browser-0000000001", {}, code="ABCD")
    again, token = store.consent("browser-0000000002", {}, code="ABCD")
    assert again is first and store.by_token(f"{first.id}.{token}") is first
    store.close()


def test_a_full_disk_changes_nothing_and_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """No state without its line; when there is room again it goes on; torn lines harm nobody."""
    store = open_store(tmp_path)
    person = join(store)
    before, write = person.state, os.write

    def half(fd: int, data: bytes) -> int:
        if b"protocol" in bytes(data):
            write(fd, bytes(data)[: len(data) // 2])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(fd, data)

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", half)
        with pytest.raises(StorageError):
            do(store, person)
        with pytest.raises(StorageError):
            join(store, "browser-0000000009")
    assert person.state == before and len(store.people) == 1
    do(store, person)
    store.close()
    again = Store(paper(), store.sessions)
    assert again.people[person.id].state == person.state
    torn = (person.folder / EVENTS_FILE).read_bytes().splitlines()
    assert any(not line.endswith(b"}") for line in torn)
    assert join(again, "browser-0000000010").entry.cell == 1  # the slot of the failed one is free
    again.close()


def test_a_locked_database_refuses_new_people_and_loses_no_answer(tmp_path: Path):
    """Answers go to the files; the index follows at the next start."""
    store = open_store(tmp_path)
    person = join(store)
    store.index.close()
    store.index = Index(store.sessions, store.study.name, busy_ms=50)
    other = Index(store.sessions, store.study.name)
    with other._write():
        with pytest.raises(StorageError, match="locked"):
            join(store, "browser-0000000002")
        do(store, person)
    assert person.state.index == 2
    assert join(store, "browser-0000000002").id == "p0002"
    other.close()
    store.close()


def test_two_servers_on_one_folder(tmp_path: Path):
    """The second one is refused."""
    with lock_study(tmp_path, "paper"):
        with pytest.raises(StudyError, match="another server"):
            with lock_study(tmp_path, "paper"):
                pass
    with lock_study(tmp_path, "paper"):
        pass


def test_test_data_and_real_data_never_mix(tmp_path: Path):
    """A folder holds the one or the other."""
    store = open_store(tmp_path)
    join(store)
    store.close()
    with pytest.raises(StudyError, match="real data"):
        Store(paper(), store.sessions, test=True)


def test_a_changed_design_is_refused_for_people_who_met_the_old_one(tmp_path: Path):
    """Their events no longer fit the plan."""
    store = open_store(tmp_path)
    person = join(store)
    while person.state.step.kind != "trial":
        do(store, person)
    store.close()
    with pytest.raises(StudyError, match="changed since"):
        Store(paper(background=()), store.sessions)


def test_withdrawal_leaves_nothing_but_the_pseudonym(tmp_path: Path):
    """Files, notes, database pages, table rows; the number is not handed out again."""
    store = open_store(tmp_path)
    person, other = join(store, code="A secret code"), join(store, "browser-0000000002")
    while person.state.is_open:
        do(store, person)
    code = store.withdrawal_code(person.id)
    identity = person.entry.person
    store.private.append(f"{person.id}.notes.jsonl", {"participant": person.id, "text": "a cold"})
    store.index.put_row(person.id, 1, {"mark": "a measured trial"})
    (person.folder / "trial-001.mcap").write_bytes(b"x")
    assert store.by_withdrawal_code(code.lower()) is person
    erased = erase_files(store, person.id)
    write_tables(store)
    assert "1 recording of a trial" in erased and "2 entries in the database" in erased
    assert store.by_withdrawal_code(code) is None
    left = [p for p in store.sessions.rglob("*") if p.is_file()]
    for secret in (identity, "a measured trial", "a cold", "A secret code"):
        assert not [p.name for p in left if secret.encode() in p.read_bytes()], secret
    left = [p for p in left if FILE not in p.name]
    holding = [p.name for p in left if person.id.encode() in p.read_bytes() or person.id in p.name]
    assert holding == ["withdrawn.jsonl"]
    store.close()
    again = Store(paper(), store.sessions)
    assert list(again.people) == [other.id]
    assert join(again, "browser-0000000003").id == "p0003"
    again.close()


def test_a_preference_is_stored_by_the_studys_order(tmp_path: Path):
    """7 is for the second method of the study file, whichever was shown as method2."""
    store = open_store(tmp_path)
    for name in ("browser-0000000001", "browser-0000000002"):
        person = join(store, name)
        while person.state.is_open:
            do(store, person)
    paths = write_tables(store)
    survey = next(p for p in paths if "survey" in p.name).read_text().splitlines()
    prefers = {line.split(",")[0]: line for line in survey if ",prefer," in line}
    assert prefers == {"p0001": "p0001,paper,,,prefer,6", "p0002": "p0002,paper,,,prefer,2"}
    controls = [line for line in survey if line.startswith("p0002") and ",control," in line]
    assert controls == [
        "p0002,paper,method1,policy,control,6",
        "p0002,paper,method2,blend,control,6",
    ]
    store.close()
