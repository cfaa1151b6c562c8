"""The protocol as a pure state machine: a state is what its events make of a plan.

Without clock, file or socket: the server, the dry run, the rebuild and the tests fold the same
events. An event that does not fit the state raises and changes nothing.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from app.study.errors import ProtocolError
from app.study.events import (
    Answered,
    AnyEvent,
    AttemptEnded,
    AttemptStarted,
    Consented,
    Drafted,
    Excluded,
    ExtraAsked,
    Left,
    Noted,
    Passed,
    Redone,
    Returned,
    Skipped,
)
from app.study.plan import Plan, Step, Task

Status = Literal["running", "completed", "excluded", "withdrawn"]
PAGES = ("instructions", "switch", "debrief")
"""Kinds of steps that `Passed` leaves."""
NOT_FAILED = ("grasped", "interrupted", "aborted")
"""Outcomes that do not count towards the most attempts."""


@dataclass(frozen=True)
class Attempt:
    """One log of a trial of the protocol."""

    started: AttemptStarted
    outcome: str = ""
    """Empty: it runs."""
    discarded: bool = False
    """The experimenter let the trial be redone."""


@dataclass(frozen=True)
class State:
    """Where one participant is.

    Attributes:
        index: Step of the plan; 0 is consent.
        status: running until done, excluded or withdrawn.
        attempts: All so far, oldest first.
        answers: Page → answers that were submitted.
        drafts: Page → answers so far.
        extra: Method of the further training trial that is under way; −1: none.
        extras: Further training trials that were asked for.
        redo: Steps to be done again before going on.
        why: Why the participant was excluded.
        notes: Notes of the experimenter.
        skipped: Steps the experimenter passed over.
    """

    plan: Plan
    max_attempts: int
    index: int = 0
    status: Status = "running"
    consent: Consented | None = None
    attempts: tuple[Attempt, ...] = ()
    answers: dict[str, dict[str, Any]] = field(default_factory=dict)
    drafts: dict[str, dict[str, Any]] = field(default_factory=dict)
    extra: int = -1
    extras: int = 0
    redo: tuple[int, ...] = ()
    why: str = ""
    notes: int = 0
    skipped: tuple[int, ...] = ()

    @property
    def at(self) -> int:
        """The step that is done now: of the plan, or one to be done again."""
        return self.redo[0] if self.redo else self.index

    @property
    def step(self) -> Step:
        """The same as a step."""
        if self.status in ("withdrawn", "excluded"):
            return Step("withdrawn", self.status)
        return self.plan.steps[self.at]

    @property
    def task(self) -> Task | None:
        """The trial that is due now."""
        if self.extra >= 0 and self.step.page == "extra":
            return self.plan.extra[self.extra]
        return self.step.task

    @property
    def running(self) -> Attempt | None:
        """The attempt whose outcome is not known yet."""
        last = self.attempts[-1] if self.attempts else None
        return last if last is not None and not last.outcome else None

    @property
    def next_attempt(self) -> int:
        """Number of the due trial's next attempt, from 1."""
        return 1 + sum(a.started.index == self.at for a in self.attempts)

    @property
    def is_open(self) -> bool:
        """Whether the participant still takes part."""
        return self.status == "running"

    def counted(self) -> dict[int, Attempt]:
        """Step → the one attempt of a recorded trial that enters the analysis."""
        return {
            a.started.index: a
            for a in self.attempts
            if a.outcome == "grasped" and a.started.part == "recorded" and not a.discarded
        }


def initial(plan: Plan, max_attempts: int) -> State:
    """Before consent."""
    return State(plan, max_attempts)


def fold(state: State, events: Iterable[AnyEvent]) -> State:
    """All events in order; errors as `apply`."""
    for event in events:
        state = apply(state, event)
    return state


def apply(state: State, event: AnyEvent) -> State:
    """The state after one event.

    Raises:
        ProtocolError: Naming the event and what would be valid.
    """
    if isinstance(event, Left):
        return replace(state, status="withdrawn", redo=(), extra=-1)
    if isinstance(event, Noted):
        return replace(state, notes=event.number)
    if isinstance(event, Redone):
        return _redo(state, event)
    if not state.is_open:
        raise ProtocolError(f"the participation is {state.status}; nothing more is accepted")
    if isinstance(event, Consented):
        _require(state, "consent", event)
        return replace(state, index=1, consent=event)
    if state.consent is None:
        raise ProtocolError("nothing is accepted before consent")
    if isinstance(event, Excluded):
        return replace(state, status="excluded", why=event.reason, redo=(), extra=-1)
    if isinstance(event, Drafted):
        return replace(state, drafts={**state.drafts, event.page: event.values})
    if isinstance(event, Answered):
        return _answer(state, event)
    if isinstance(event, Passed):
        return _pass(state, event)
    if isinstance(event, Returned):
        return _return(state, event)
    if isinstance(event, ExtraAsked):
        return _ask_extra(state, event)
    if isinstance(event, AttemptStarted):
        return _start(state, event)
    if isinstance(event, AttemptEnded):
        return _end(state, event)
    return _skip(state, event)


def page_name(step: Step) -> str:
    """What a page's answers are filed under."""
    return step.page if step.kind == "survey" else step.kind


def _require(state: State, kind: str, event: AnyEvent) -> None:
    if state.step.kind != kind:
        name = type(event).__name__.lower()
        raise ProtocolError(f"{name} is for the step {kind}; this participant is at {_here(state)}")


def _here(state: State) -> str:
    step = state.step
    return f"{step.kind} {step.page}".strip()


def _forward(state: State) -> State:
    """Go on: to what is to be done again, else to the next step; the last one is the end."""
    if state.redo:
        return replace(state, redo=state.redo[1:])
    index = state.index + 1
    done = state.plan.steps[index].kind == "done"
    return replace(state, index=index, status="completed" if done else state.status)


def _answer(state: State, event: Answered) -> State:
    if state.step.kind not in ("background", "device", "survey"):
        raise ProtocolError(f"{event.page} is not asked at {_here(state)}")
    if event.page != page_name(state.step):
        raise ProtocolError(f"answers of {event.page}; valid here: {page_name(state.step)}")
    drafts = {k: v for k, v in state.drafts.items() if k != event.page}
    answers = {**state.answers, event.page: event.values}
    return _forward(replace(state, answers=answers, drafts=drafts))


def _pass(state: State, event: Passed) -> State:
    step = state.step
    free = step.kind == "training" and step.page in ("free", "extra") and state.extra < 0
    if step.kind not in PAGES and not free:
        raise ProtocolError(f"{_here(state)} is not left by Continue")
    if event.page != _here(state):
        raise ProtocolError(f"Continue of {event.page}; valid here: {_here(state)}")
    if state.running is not None:
        raise ProtocolError("a trial still runs")
    return _forward(state)


def can_return(state: State) -> bool:
    """Whether the step before is a survey whose answers may still be changed."""
    open_again = state.step.kind in ("survey", "debrief") and state.is_open and not state.redo
    return open_again and state.plan.steps[state.index - 1].kind == "survey"


def _return(state: State, event: Returned) -> State:
    if not can_return(state):
        raise ProtocolError(f"there is no way back from {_here(state)}")
    page = state.plan.steps[state.index - 1].page
    if event.page != page:
        raise ProtocolError(f"back to {event.page}; valid here: {page}")
    drafts = {**state.drafts, page: state.answers.get(page, {})}
    return replace(state, index=state.index - 1, drafts=drafts)


def _ask_extra(state: State, event: ExtraAsked) -> State:
    if state.step.page != "extra" or state.extra >= 0:
        raise ProtocolError(f"further training is not offered at {_here(state)}")
    if state.extras >= state.plan.max_extra:
        raise ProtocolError(f"{state.extras} further trials were done; valid: at most that many")
    if not 0 <= event.place < len(state.plan.extra):
        raise ProtocolError(f"place is {event.place}; valid: 0 to {len(state.plan.extra) - 1}")
    return replace(state, extra=event.place, extras=state.extras + 1)


def _start(state: State, event: AttemptStarted) -> State:
    if state.task is None:
        raise ProtocolError(f"there is no trial at {_here(state)}")
    if state.running is not None:
        raise ProtocolError("a trial runs already")
    if (event.index, event.attempt) != (state.at, state.next_attempt):
        raise ProtocolError(
            f"attempt {event.attempt} of step {event.index}; due: attempt {state.next_attempt} "
            f"of step {state.at}"
        )
    return replace(state, attempts=(*state.attempts, Attempt(event)))


def _end(state: State, event: AttemptEnded) -> State:
    running = state.running
    if running is None:
        raise ProtocolError("no trial runs that could end")
    started = running.started
    if (event.index, event.attempt, event.trial) != (started.index, started.attempt, started.trial):
        raise ProtocolError(f"trial {event.trial} has ended; the one that runs is {started.trial}")
    attempts = (*state.attempts[:-1], replace(running, outcome=event.outcome))
    state = replace(state, attempts=attempts)
    if state.step.page == "free":
        return state
    failures = _failures(state)
    if event.outcome == "grasped" or failures >= state.max_attempts or state.extra >= 0:
        if state.extra >= 0:
            again = event.outcome in ("interrupted", "aborted")
            return state if again else replace(state, extra=-1)
        return _forward(state)
    return state


def _failures(state: State) -> int:
    """Attempts at the due trial that count towards the most."""
    return sum(
        a.started.index == state.at
        and bool(a.outcome)
        and a.outcome not in NOT_FAILED
        and not a.discarded
        for a in state.attempts
    )


def is_last_chance(state: State) -> bool:
    """Whether the due trial is over even if this attempt fails."""
    return state.extra >= 0 or _failures(state) + 1 >= state.max_attempts


def _redo(state: State, event: Redone) -> State:
    steps = state.plan.steps
    valid = 0 <= event.index <= state.index and steps[event.index].task is not None
    if not valid or steps[event.index].page == "free":
        raise ProtocolError(f"step {event.index} is no trial that was done")
    if not state.is_open:
        raise ProtocolError(f"the participation is {state.status}")
    if state.running is not None:
        raise ProtocolError("a trial runs; it has to end first")
    attempts = tuple(
        replace(a, discarded=True) if a.started.index == event.index else a for a in state.attempts
    )
    state = replace(state, attempts=attempts)
    if event.index == state.index or event.index in state.redo:
        return state
    return replace(state, redo=(event.index, *state.redo))


def _skip(state: State, event: AnyEvent) -> State:
    if not isinstance(event, Skipped):
        raise ProtocolError(f"{type(event).__name__} is no event of the protocol")
    if event.index != state.at or state.step.kind in ("consent", "done"):
        raise ProtocolError(f"step {event.index} cannot be skipped at {_here(state)}")
    if state.running is not None:
        raise ProtocolError("a trial runs; it has to end first")
    return _forward(replace(state, skipped=(*state.skipped, event.index), extra=-1))
