"""A participant's browser session: runs the trials of the protocol in ordinary workers.

One worker serves all trials that look alike (one method, in one part); the next trial of the
protocol is a `new-trial` command of ours. What the browser may send is `start` and `grasp`.
"""

import asyncio
import logging
from collections.abc import Coroutine
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from app.recording.listing import entry_of
from app.recording.numbering import trial_name
from app.session.session import SERVER
from app.session.spec import WorkerSpec
from app.study.errors import ProtocolError, StudyError
from app.study.events import AttemptEnded, AttemptStarted
from app.study.plan import Task
from app.study.server.spec import trial_command, worker_key, worker_spec
from app.study.store import Person
from app.web.channel import Head
from app.web.config import ServerConfig
from app.web.session import Client, Session, StartRefusedError, to_json
from app.web.worker import Ending, Worker

if TYPE_CHECKING:
    from app.study.server.host import Host

LOG_PATIENCE_S = 20.0
"""How long a finished log may take to reach the disk before the trial counts as interrupted."""
RESULT_S = 2.0
"""How long a person reads how the trial ended before the next one is set up."""

ALL_TAKEN = "All robots are in use just now. It is your turn as soon as one of them is free."

logger = logging.getLogger("hindsight.study")


class TrialStatus(msgspec.Struct, frozen=True):
    """What we read of a status message's trial."""

    number: int
    phase: str
    outcome: str


class _Status(msgspec.Struct, frozen=True):
    trial: TrialStatus


class _Ack(msgspec.Struct, frozen=True):
    error: str | None = None


_STATUS = msgspec.json.Decoder(_Status)
_ACK = msgspec.json.Decoder(_Ack)


class StudySession(Session):
    """Of one participant, as long as this server runs."""

    def __init__(self, host: "Host", participant: str) -> None:
        super().__init__()
        self.shares_watch = False
        self.participant = participant
        self.trial: TrialStatus | None = None
        """The newest status."""
        self._host = host
        self._key: tuple[Any, ...] = ()
        self._log = 0
        """Number of the running attempt's log; 0: the worker has not said it yet."""
        self._past = 0
        """Highest number of a log that is over."""
        self._moving = False
        self._over = False
        self._turn = asyncio.Lock()
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def person(self) -> Person:
        """The participant; raises KeyError once their data are deleted."""
        return self._host.store.people[self.participant]

    @property
    def start_key(self) -> str:
        """Starts are bound for each attempt at each step, not over the whole participation."""
        person = self._host.store.people.get(self.participant)
        return f"{self.id}/{person.state.at}/{person.state.extras}" if person else self.id

    def worker_spec(self, config: ServerConfig) -> WorkerSpec:
        """The worker whose first trial is the one that is due."""
        person = self._host.store.people.get(self.participant)
        if person is None or person.state.task is None or self._host.ending:
            raise StartRefusedError("There is no trial to be done now.")
        try:
            resolve_open(self._host, person)
        except StudyError as error:
            raise StartRefusedError(str(error)) from None
        task = person.state.task
        if task is None:
            raise StartRefusedError("There is no trial to be done now.")
        registry = self._host.registry
        if registry is not None and registry.workers.full:
            raise StartRefusedError(ALL_TAKEN)
        self._key = worker_key(task)
        self._log, self._moving, self._over = 0, False, False
        self._past = max((a.started.trial for a in person.state.attempts), default=0)
        return worker_spec(self._host.store, person, task, self.id, config)

    # what the worker says

    def receive(self, head: Head, text: str) -> None:
        """Watch the trial, and pass everything on to the pages."""
        if head.type == "status":
            self._watch(_STATUS.decode(text).trial)
        elif head.type == "ack" and head.client == SERVER:
            error = _ACK.decode(text).error
            if error:
                logger.error("%s: the next trial was refused: %s", self.participant, error)
                self.end_worker()
            return
        super().receive(head, text)

    def worker_gone(self, worker: Worker, ending: Ending) -> None:
        """A trial that ran is interrupted; one that was over is being finished already."""
        mine = self.worker is worker
        super().worker_gone(worker, ending)
        if mine and self._log and not self._over:
            log, self._log = self._log, 0
            self._start(self._interrupt(log, ending.cause))

    def leave(self, client: Client) -> None:
        """Where the page in control goes while the arm moves, the trial is interrupted."""
        controlled = self.control is client
        super().leave(client)
        if controlled and self._moving and not self._over and self._log:
            log, self._log, self._moving = self._log, 0, False
            self._start(self._interrupt(log, "the page was left or lost its line"))

    def end_worker(self) -> None:
        """Ask the worker to close its log and exit."""
        if self.worker is not None:
            self.worker.end()

    async def stop(self) -> None:
        """End the worker and wait until it is gone and its log is closed."""
        self.end_worker()
        while self.worker is not None:
            await asyncio.sleep(0.05)
        async with self._turn:
            pass

    def drop_trial(self) -> None:
        """Forget the running attempt, which somebody else has ended; the worker ends."""
        self._past = max(self._past, self._log)
        self._log, self._moving, self._over = 0, False, False
        self.end_worker()

    async def interrupt(self, reason: str) -> None:
        """Another's doing: the running attempt does not count, and the worker ends."""
        self.drop_trial()
        await self._end_running(reason)

    def tell(self, **fields: Any) -> None:
        """Say something to all pages of this participant."""
        self._broadcast(to_json({"type": "study", **fields}))

    def _watch(self, trial: TrialStatus) -> None:
        self.trial = trial
        if trial.number <= self._past:
            return
        if self._log == 0 and not self._over and trial.phase == "ready":
            self._log = trial.number
            self._start(self._begin(trial.number))
        if trial.number != self._log:
            return
        self._moving = trial.phase == "running"
        if trial.outcome != "running" and not self._over:
            self._over = True
            self._start(self._finish(trial.number))

    # what follows from it

    def _start(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(self._guard(work))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _guard(self, work: Coroutine[Any, Any, None]) -> None:
        """One thing at a time; what fails is logged, and the worker is started afresh."""
        async with self._turn:
            try:
                await work
            except (StudyError, KeyError) as error:
                logger.error("%s: %s", self.participant, error)
                self.tell(event="failed")
                self.end_worker()

    async def _begin(self, number: int) -> None:
        """A new trial stands ready in the worker."""
        state = self.person.state
        task = state.task
        if task is None:
            self.end_worker()
            return
        event = AttemptStarted(
            index=state.at,
            attempt=state.next_attempt,
            trial=number,
            part=task.part,
            place=task.place,
            condition=task.condition,
            label=task.label,
            target=task.target,
            seed=task.seed + state.next_attempt - 1,
        )
        await self._host.happen(self.participant, event)
        self.tell(event="ready", trial=number)

    async def _interrupt(self, log: int, reason: str) -> None:
        running = self.person.state.running
        if running is None or running.started.trial != log:
            return
        await self._end_running(reason)
        logger.info("%s: trial %d was interrupted: %s", self.participant, log, reason)
        self.tell(event="changed")
        self._next(log)

    async def _end_running(self, reason: str) -> None:
        """End the running attempt, unless another (a dropped line, the desk) has just done so."""
        running = self.person.state.running
        if running is None:
            return
        event = ended(running.started, "interrupted", reason)
        try:
            await self._host.happen(self.participant, event)
        except ProtocolError:
            if self.person.state.running is running:
                raise

    async def _finish(self, number: int) -> None:
        """Wait for the log, note the outcome it holds, and set up what comes next."""
        running = self.person.state.running
        if running is None or running.started.trial != number:
            return
        path = self.person.folder / trial_name(number)
        outcome, reason = await _outcome_of(path)
        if reason:
            logger.error("%s: trial %d: %s", self.participant, number, reason)
        await self._host.happen(self.participant, ended(running.started, outcome, reason))
        self.tell(event="changed")
        await self._host.keep_row(self.participant, number)
        await asyncio.sleep(self._host.result_s)
        self._next(number)

    def _next(self, past: int) -> None:
        """Let the worker set up the trial that is due, or end where it is not of its kind."""
        self._past = max(self._past, past)
        self._log, self._moving, self._over = 0, False, False
        if self.worker is None:
            return
        state = self.person.state
        task: Task | None = state.task
        if task is None or not state.is_open or worker_key(task) != self._key:
            self.end_worker()
            return
        self.worker.send(trial_command(task, state.next_attempt))


def ended(started: AttemptStarted, outcome: str, reason: str = "") -> AttemptEnded:
    """The event that ends an attempt."""
    return AttemptEnded(
        index=started.index,
        attempt=started.attempt,
        trial=started.trial,
        outcome=outcome,
        reason=reason,
    )


def resolve_open(host: "Host", person: Person) -> None:
    """End an attempt that a dead worker or server left open, by what its log says.

    A trial whose outcome reached the disk counts, also where the server died before noting it.
    """
    running = person.state.running
    if running is None:
        return
    path = person.folder / trial_name(running.started.trial)
    outcome = entry_of(path).outcome if path.exists() else ""
    if outcome in ("", "running", "aborted"):
        outcome = "interrupted"
    host.store.append(person.id, ended(running.started, outcome, "found at a new start"))


async def _outcome_of(path: Path) -> tuple[str, str]:
    """Outcome of a log once it is finished on the disk, and what was wrong."""
    waited_s = 0.0
    while not path.exists():
        if waited_s > LOG_PATIENCE_S:
            return "interrupted", f"{path.name} did not reach the disk"
        await asyncio.sleep(0.05)
        waited_s += 0.05
    entry = await asyncio.to_thread(entry_of, path)
    if entry.problem:
        return "interrupted", entry.problem
    return entry.outcome, ""
