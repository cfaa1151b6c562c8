"""All participants of one study: their files are the record, memory and SQLite follow.

An event is checked, appended to the participant's `events.jsonl` and forced to the disk, and only
then becomes the state. Nothing here is asynchronous; the server calls it from threads.
"""

import hashlib
import logging
import os
import secrets
import shutil
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

from app.recording.errors import RecordingError
from app.recording.folders import EVENTS_FILE, append_event, open_session, read_events
from app.robot.scene_file import load_scene
from app.study.errors import ProtocolError, StorageError, StudyError
from app.study.events import NAME, AnyEvent, Consented, from_line, to_detail
from app.study.index import Entry, Index
from app.study.plan import cells, make_plan
from app.study.private import PrivateFolder, digest
from app.study.protocol import State, apply, fold, initial
from app.study.schema import Study

SESSION = "1"
WITHDRAWN_FILE = "withdrawn.jsonl"
"""Pseudonyms whose data were deleted: they are not handed out again."""

logger = logging.getLogger("hindsight.study")


@dataclass
class Person:
    """One participant in memory."""

    id: str
    folder: Path
    state: State
    entry: Entry

    @property
    def consent(self) -> Consented:
        """The first event; everybody in memory has one."""
        assert self.state.consent is not None
        return self.state.consent


class Store:
    """Owns the files of one study."""

    def __init__(self, study: Study, sessions: Path, *, test: bool = False) -> None:
        """Open the study's folder and read everybody who takes part.

        Args:
            study: The study.
            sessions: Folder of all sessions.
            test: Whether new data are those of a test run.

        Raises:
            StudyError: If the folder cannot be used or holds something else.
        """
        self.study, self.sessions, self.test = study, sessions, test
        self.root = sessions / study.name
        self.raw = self.root / "data" / "raw"
        self.objects = load_scene(study.scene).object_names
        self.people: dict[str, Person] = {}
        self._locks: dict[str, threading.RLock] = {}
        try:
            self.raw.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StudyError(f"cannot use {self.raw}: {error.strerror}") from None
        self.private = PrivateFolder(sessions, study.name)
        self.index = Index(sessions, study.name)
        self._load()

    def close(self) -> None:
        """Close the index."""
        self.index.close()

    # arrival

    def consent(
        self,
        request: str,
        parameters: dict[str, str],
        *,
        code: str = "",
        pilot: bool = False,
        fast: bool = False,
    ) -> tuple[Person, str]:
        """Let somebody take part; the same request gives the same participant again.

        Args:
            request: The browser's own random number for this consent.
            parameters: Recruitment parameters the link carried.
            code: The code that was typed.
            pilot: Whether the participant counts nowhere.
            fast: One training trial a method (test runs).

        Returns:
            The participant, and a fresh secret for the cookie.

        Raises:
            ProtocolError: If this person takes part already, in another browser.
            StorageError: If it cannot be saved.
        """
        token = secrets.token_urlsafe(32)
        person_name = code or parameters.get(self.study.arrival.person, "")
        person = digest(f"{self.study.name}/{person_name}") if person_name else ""
        entry, new = self.index.claim(
            len(cells(self.study)),
            "t" if self.test else "p",
            request=digest(request),
            person=person,
            token=digest(token),
            pilot=pilot,
            abandoned_s=60.0 * self.study.abandoned_after_min,
        )
        if not new:
            same = entry.request == digest(request) or bool(code)
            if entry.id not in self.people or not same:
                raise ProtocolError(
                    "You have begun this study in another browser already. Please go on there; if "
                    "you cannot, tell the experimenter."
                )
            return self.people[entry.id], self.renew_token(entry.id)
        try:
            return self._begin(entry, parameters, code, fast), token
        except (StudyError, RecordingError) as error:
            self.index.remove(entry.id)
            shutil.rmtree(self.subject_folder(entry.id), ignore_errors=True)
            raise StorageError(str(error)) from None

    def renew_token(self, participant: str) -> str:
        """A new secret for the participant's cookie; the old one is worth nothing then."""
        token = secrets.token_urlsafe(32)
        person = self.people[participant]
        entry = replace(person.entry, token=digest(token))
        self.private.update(participant, {"token": entry.token})
        self._index(person, entry)
        return token

    def by_token(self, value: str) -> Person | None:
        """The participant of a cookie `p0001.secret`."""
        participant, _, token = value.partition(".")
        person = self.people.get(participant)
        same = person and secrets.compare_digest(person.entry.token, digest(token))
        return person if same else None

    def by_withdrawal_code(self, code: str) -> Person | None:
        """The participant of a withdrawal code."""
        wanted = digest(code.strip().upper())
        return next((p for p in self.people.values() if p.entry.withdrawal == wanted), None)

    # what happens

    def append(self, participant: str, event: AnyEvent) -> State:
        """Let an event happen: check, write, then change the state.

        Raises:
            ProtocolError: If it does not fit; nothing was changed.
            StorageError: If it could not be written; nothing was changed.
        """
        with self.lock(participant):
            person = self.people.get(participant)
            if person is None:
                raise ProtocolError(f"there is no participant {participant!r}")
            state = apply(person.state, event)
            self._write(person.folder, event)
            person.state = state
            try:
                entry = replace(person.entry, status=state.status, seen_s=time.time())
                self._index(person, entry)
            except StorageError as error:
                # The files know; the index follows at the next event or start.
                logger.warning("%s: %s", participant, error)
            return state

    def withdrawal_code(self, participant: str) -> str:
        """The participant's code for a later withdrawal, made at first need."""
        known = self.private.read(participant).get("withdrawal_code")
        if known:
            return str(known)
        alphabet = "ABCDEFGHJKMNPQRSTUVWXYZ23456789"
        code = "-".join("".join(secrets.choice(alphabet) for _ in range(4)) for _ in range(3))
        self.private.update(participant, {"withdrawal_code": code})
        person = self.people[participant]
        self._index(person, replace(person.entry, withdrawal=digest(code)))
        return code

    def subject_folder(self, participant: str) -> Path:
        """All files of a participant but the private ones."""
        return self.raw / f"subject-{participant}"

    @contextmanager
    def lock(self, participant: str) -> Iterator[None]:
        """One thing at a time for each participant."""
        with self._locks.setdefault(participant, threading.RLock()):
            yield

    # files

    def _begin(self, entry: Entry, parameters: dict[str, str], code: str, fast: bool) -> Person:
        consent = self.study.consent
        plan = make_plan(self.study, self.objects, entry.cell, entry.slot, fast=fast)
        event = Consented(
            version=consent.version,
            digest=hashlib.sha256(consent.model_dump_json().encode()).hexdigest()[:16],
            cell=entry.cell,
            slot=entry.slot,
            pilot=entry.pilot,
            test=self.test,
            fast=fast,
        )
        self.private.update(
            entry.id,
            {
                "token": entry.token,
                "request": entry.request,
                "person": entry.person,
                "parameters": parameters,
                "code": code,
                "consent": {"version": consent.version, "at_s": time.time(), "agreed": True},
            },
        )
        about = {
            "study_version": self.study.version,
            "design": design_digest(self.study),
            "order": list(plan.order),
            "labels": list(plan.labels),
            "test_run": self.test,
        }
        folder = open_session(self.sessions, self.study.name, entry.id, SESSION, about)
        state = apply(initial(plan, self.study.trials.attempts), event)
        self._write(folder, event)
        person = Person(entry.id, folder, state, entry)
        self.people[entry.id] = person
        return person

    def _write(self, folder: Path, event: AnyEvent) -> None:
        try:
            mend(folder / EVENTS_FILE)
            append_event(folder, NAME, to_detail(event))
        except (RecordingError, OSError) as error:
            raise StorageError(str(error)) from None

    def _index(self, person: Person, entry: Entry) -> None:
        person.entry = entry
        self.index.put(entry)

    # start

    def _load(self) -> None:
        for folder in sorted(self.raw.glob(f"subject-*/session-{SESSION}")):
            participant = folder.parent.name.removeprefix("subject-")
            person = self._read(participant, folder)
            if person is not None:
                self.people[participant] = person
        if any(p.consent.test != self.test for p in self.people.values()):
            held, wanted = ("test data", "another") if not self.test else ("real data", "an empty")
            raise StudyError(
                f"{self.root} holds {held}; choose {wanted} folder with --sessions, so that the "
                "two never mix"
            )
        for person in list(self.people.values()):
            if person.state.status == "withdrawn":  # killed while deleting
                erase_files(self, person.id)
        gone = self.raw / WITHDRAWN_FILE
        left = [
            Entry(str(line["participant"]), 0, -1, True, "withdrawn", 0.0)
            for line in _lines(gone)
            if str(line.get("participant", ""))[1:].isdigit()
        ]
        self.index.replace_all([*left, *(p.entry for p in self.people.values())])

    def _read(self, participant: str, folder: Path) -> Person | None:
        """What the files say of one participant; None where consent was never completed."""
        lines = read_events(folder)
        try:
            events = [event for line in lines if (event := from_line(line)) is not None]
        except msgspec.ValidationError as error:
            raise StudyError(f"{folder / EVENTS_FILE}: {error}") from None
        if not events or not isinstance(events[0], Consented):
            return None
        consent = events[0]
        plan = make_plan(self.study, self.objects, consent.cell, consent.slot, fast=consent.fast)
        try:
            state = fold(initial(plan, self.study.trials.attempts), events)
        except ProtocolError as error:
            raise StudyError(
                f"{folder / EVENTS_FILE} does not fit this study file ({error}). Was the file "
                "changed since? Give the changed study a name of its own."
            ) from None
        known = self.private.read(participant)
        code = known.get("withdrawal_code", "")
        entry = Entry(
            participant,
            consent.cell,
            consent.slot,
            consent.pilot,
            state.status,
            max((float(line.get("wall_s", 0.0)) for line in lines), default=0.0),
            str(known.get("token", "")),
            str(known.get("request", "")),
            str(known.get("person", "")),
            digest(code) if code else "",
        )
        return Person(participant, folder, state, entry)


def design_digest(study: Study) -> str:
    """Changes where the design does, not where its words do."""
    fields = {"conditions", "order", "seed", "scene", "preset", "training", "trials", "label"}
    text = study.model_dump_json(include=fields)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def mend(path: Path) -> None:
    """End a line that a full disk or a kill left torn, so that the next one is not lost with it."""
    try:
        fd = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CLOEXEC)
    except FileNotFoundError:
        return
    try:
        size = os.fstat(fd).st_size
        if size and os.pread(fd, 1, size - 1) != b"\n":
            os.write(fd, b"\n")
    finally:
        os.close(fd)


def erase_files(store: Store, participant: str) -> list[str]:
    """Delete everything that is kept of a participant; returns what, for them to read.

    A pseudonym in a list of the withdrawn is all that stays: it is not handed out again.
    """
    folder = store.subject_folder(participant)
    logs = sorted(p for p in folder.rglob("*") if p.is_file())
    n_trials = sum(p.name.endswith((".mcap", ".mcap.part")) for p in logs)
    n_caches = sum(p.suffix == ".parquet" for p in logs)
    if participant not in {str(line.get("participant")) for line in _lines(_gone(store))}:
        _append_line(_gone(store), {"participant": participant})
    shutil.rmtree(folder, ignore_errors=False) if folder.exists() else None
    private = store.private.forget(participant)
    rows = store.index.remove(participant)
    store.people.pop(participant, None)
    store.index.put(Entry(participant, 0, -1, True, "withdrawn", 0.0))
    numbers = {
        "recording of a trial": n_trials,
        "file derived from recordings": n_caches,
        "file on the course of the session, with your answers": len(logs) - n_trials - n_caches,
        "entry in the database": rows,
    }
    return [
        *(_count(n, what) for what, n in numbers.items() if n),
        "your consent, identifier and comments, and notes about your session"
        if private
        else "no private data were kept",
        "your lines in the tables, and with them in every export from now on",
    ]


def _count(n: int, what: str) -> str:
    """1 recording of a trial, 2 recordings of a trial."""
    noun, space, rest = what.partition(" ")
    plural = f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"
    return f"{n} {noun if n == 1 else plural}{space}{rest}"


def _gone(store: Store) -> Path:
    return store.raw / WITHDRAWN_FILE


def _append_line(path: Path, line: dict[str, Any]) -> None:
    with path.open("ab") as file:
        file.write(msgspec.json.encode(line) + b"\n")
        file.flush()
        os.fsync(file.fileno())


def _lines(path: Path) -> list[dict[str, Any]]:
    try:
        lines = path.read_bytes().splitlines()
    except FileNotFoundError:
        return []
    return [msgspec.json.decode(line) for line in lines if line.startswith(b"{")]
