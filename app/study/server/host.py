"""One study being hosted: its store, its participants' sessions, and what is done in turn."""

import asyncio
import contextlib
import hashlib
import hmac
import logging
from dataclasses import dataclass, field
from typing import Any

from app.study.errors import ProtocolError, StudyError
from app.study.events import Answered, AnyEvent, Drafted, Excluded, Left, Passed
from app.study.items import AnyItem, Text, check_answers, ineligible, survey_items
from app.study.plan import Step
from app.study.protocol import State, page_name
from app.study.rows import measure
from app.study.server.device import DEVICE_ITEMS
from app.study.server.session import RESULT_S, StudySession, ended, resolve_open
from app.study.store import Person, Store, erase_files
from app.study.tables import write_tables
from app.web.config import ServerConfig
from app.web.sessions import SessionRegistry

logger = logging.getLogger("hindsight.study")


@dataclass
class Host:
    """What the study's routes share.

    Attributes:
        store: Files and state of all participants.
        config: The server's settings.
        registry: Of browser sessions; set once the application is there.
        paused: Whether nobody new is taken.
        ending: Whether the server is stopping.
        result_s: How long an outcome is shown before the next trial is set up.
    """

    store: Store
    config: ServerConfig
    registry: SessionRegistry | None = None
    paused: bool = False
    ending: bool = False
    result_s: float = RESULT_S
    sessions: dict[str, StudySession] = field(default_factory=dict)
    saved: set[str] = field(default_factory=set)
    """Participants whose tables are on the disk."""
    signing_key: bytes = b""
    _saving: asyncio.Lock = field(default_factory=asyncio.Lock)

    def __post_init__(self) -> None:
        self.signing_key = self.store.private.key()

    def is_pilot_key(self, value: str) -> bool:
        """Whether a link is the experimenter's link for pilots."""
        return hmac.compare_digest(value.encode(), self.pilot_key.encode())

    @property
    def pilot_key(self) -> str:
        """What the link for pilots carries."""
        return self._derive("pilot")[:16]

    def own_code(self, participant: str) -> str:
        """A completion code of the participant's own, where the study has none."""
        return self._derive(f"completion/{participant}")[:10].upper()

    def _derive(self, purpose: str) -> str:
        return hmac.new(self.signing_key, purpose.encode(), hashlib.sha256).hexdigest()

    async def consent(
        self, request: str, parameters: dict[str, str], **about: Any
    ) -> tuple[Person, str]:
        """Take somebody in; as `Store.consent`."""
        return await asyncio.to_thread(self.store.consent, request, parameters, **about)

    def session(self, participant: str) -> StudySession:
        """The participant's browser session in this run of the server."""
        assert self.registry is not None
        session = self.sessions.get(participant)
        if session is None or self.registry.by_id(session.id) is not session:
            session = StudySession(self, participant)
            self.sessions[participant] = session
            self.registry.add(session)
        return session

    def resolve_all(self) -> None:
        """At the start: end the attempts that an earlier run of the server left open."""
        for person in list(self.store.people.values()):
            try:
                resolve_open(self, person)
            except StudyError as error:
                logger.error("%s: %s", person.id, error)

    async def happen(self, participant: str, event: AnyEvent) -> State:
        """Let an event happen, beside the event loop; errors as `Store.append`."""
        return await asyncio.to_thread(self.store.append, participant, event)

    # pages

    async def draft(self, person: Person, page: str, values: dict[str, Any]) -> None:
        """Keep answers so far, so that nothing answered is asked again after a crash.

        Raises:
            AnswerError: If one of them is not valid.
            ProtocolError: If this page is not being answered.
        """
        if page != page_name(person.state.step):
            raise ProtocolError(f"answers of {page}; asked now: {page_name(person.state.step)}")
        items = self.items(person, page)
        known = check_answers(items, values, partial=True)
        await self._keep_texts(person, page, items, known)
        plain = _without_texts(items, known)
        if plain != person.state.drafts.get(page, {}):
            await self.happen(person.id, Drafted(page=page, values=plain))

    async def answer(self, person: Person, page: str, values: dict[str, Any]) -> None:
        """Take a page's answers and go on.

        Raises:
            AnswerError: Naming what is missing or not valid.
            ProtocolError: If this page is not being answered.
        """
        if page != page_name(person.state.step):
            raise ProtocolError(f"answers of {page}; asked now: {page_name(person.state.step)}")
        items = self.items(person, page)
        answers = check_answers(items, values)
        await self._keep_texts(person, page, items, answers)
        reason = ineligible(items, answers) if page == "background" else ""
        await self.happen(person.id, Answered(page=page, values=_without_texts(items, answers)))
        if reason:
            await self.happen(person.id, Excluded(reason=reason))

    async def go_on(self, person: Person, page: str) -> None:
        """Leave a page by Continue; free practice ends where it was being done."""
        running = person.state.running
        if running is not None and running.started.part == "free":
            self.session(person.id).drop_trial()
            await self.happen(person.id, ended(running.started, "aborted", "practised enough"))
        await self.happen(person.id, Passed(page=page))

    def items(self, person: Person, page: str) -> dict[str, AnyItem]:
        """What a page asks."""
        study = self.store.study
        if page == "background":
            return {item.id: item for item in study.background}
        if page == "device":
            return DEVICE_ITEMS
        survey = next((s for s in study.surveys if s.id == page), None)
        return survey_items(survey, person.state.plan.labels) if survey else {}

    def texts(self, person: Person, page: str) -> dict[str, str]:
        """Free text of a page, from the private file."""
        return self.store.private.read(person.id).get("texts", {}).get(page, {})

    async def _keep_texts(
        self, person: Person, page: str, items: dict[str, AnyItem], values: dict[str, Any]
    ) -> None:
        given = {k: v for k, v in values.items() if isinstance(items[k], Text)}

        def write() -> None:
            with self.store.lock(person.id):
                known = self.store.private.read(person.id).get("texts", {})
                if known.get(page, {}) != given:
                    self.store.private.update(person.id, {"texts": {**known, page: given}})

        await asyncio.to_thread(write)

    # the end

    async def keep_row(self, participant: str, trial: int) -> None:
        """Measure a finished trial now, so that nobody waits for it at the end."""
        person = self.store.people.get(participant)
        if person is None:
            return
        attempt = next((a for a in person.state.attempts if a.started.trial == trial), None)
        if attempt is None or attempt.started.part == "free":
            return
        try:
            row = await asyncio.to_thread(measure, self.store, person, attempt)
            await asyncio.to_thread(self.store.index.put_row, participant, trial, row)
        except StudyError as error:
            logger.warning("%s: trial %d: %s", participant, trial, error)

    async def save(self, person: Person) -> str:
        """Bring a participation that is over to the disk, tables included; once.

        Returns:
            The withdrawal code.

        Raises:
            StorageError: If something could not be written; asking again tries again.
        """
        session = self.sessions.get(person.id)
        if session is not None and session.worker is not None:
            await session.stop()
        async with self._saving:
            if person.id not in self.saved:
                await asyncio.to_thread(write_tables, self.store)
                self.saved.add(person.id)
            return await asyncio.to_thread(self.store.withdrawal_code, person.id)

    async def withdraw(self, person: Person) -> list[str]:
        """Delete everything of a participant; returns what was deleted.

        Raises:
            StorageError: If something could not be deleted; the next start tries again.
        """
        session = self.sessions.pop(person.id, None)
        with contextlib.suppress(ProtocolError):
            await self.happen(person.id, Left())
        if session is not None:
            await session.stop()
            session.say_ended("You have left the study.")
        async with self._saving:
            erased = await asyncio.to_thread(erase_files, self.store, person.id)
            await asyncio.to_thread(write_tables, self.store)
            self.saved.discard(person.id)
        logger.info("%s withdrew; deleted: %s", person.id, "; ".join(erased))
        return erased


def _without_texts(items: dict[str, AnyItem], values: dict[str, Any]) -> dict[str, Any]:
    return {k: v for k, v in values.items() if not isinstance(items[k], Text)}


def here(step: Step) -> str:
    """The name by which Continue leaves a step."""
    return f"{step.kind} {step.page}".strip()
