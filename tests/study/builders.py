"""Studies, stores and participants for tests, without a server."""

from pathlib import Path
from typing import Any

from app.study.events import Answered, AttemptEnded, AttemptStarted, Consented, Passed
from app.study.load import load_study
from app.study.plan import Plan, make_plan
from app.study.protocol import State, apply, initial, page_name
from app.study.schema import Study
from app.study.server.host import here
from app.study.store import Store

OBJECTS = ("canteen", "block", "glass")
DEVICE = {"webgl": "yes", "input": "pointer", "gamepad": "no", "width_px": 1024, "height_px": 640}
DEVICE |= {"pixel_ratio": 1, "frame_rate_hz": 60.0, "round_trip_ms": 20.0, "touch": "no"}
DEVICE |= {"browser": "Test browser"}
BACKGROUND = {"gender": "female", "experience": "some", "prior_exposure": "no"}


def paper(**changes: Any) -> Study:
    """The shipped study with some fields changed."""
    return load_study("paper").model_copy(update=changes)


def fast_plan(cell: int = 0, slot: int = 0) -> Plan:
    """The shortest plan of the paper's study."""
    return make_plan(paper(), OBJECTS, cell, slot, fast=True)


def start(plan: Plan | None = None, max_attempts: int = 5) -> State:
    """A participant who has just consented."""
    consent = Consented(version="1", digest="d", cell=0, slot=0, test=True, fast=True)
    return apply(initial(plan or fast_plan(), max_attempts), consent)


def attempt(state: State, outcome: str = "grasped", trial: int = 0) -> State:
    """One attempt at the trial that is due."""
    task = state.task
    assert task is not None
    number = trial or 1 + max((a.started.trial for a in state.attempts), default=0)
    started = AttemptStarted(
        index=state.at,
        attempt=state.next_attempt,
        trial=number,
        part=task.part,
        place=task.place,
        condition=task.condition,
        label=task.label,
        target=task.target,
        seed=task.seed,
    )
    state = apply(state, started)
    ended = AttemptEnded(
        index=started.index, attempt=started.attempt, trial=number, outcome=outcome
    )
    return apply(state, ended) if outcome else state


def advance(state: State) -> State:
    """Do what the step asks for, well."""
    step = state.step
    if state.task is not None:
        return attempt(state)
    if step.kind in ("background", "device", "survey"):
        return apply(state, Answered(page=page_name(step), values={}))
    return apply(state, Passed(page=here(step)))


def until(state: State, kind: str, page: str | None = None) -> State:
    """Go on to the first step of this kind."""
    while state.step.kind != kind or (page is not None and state.step.page != page):
        state = advance(state)
    return state


def survey_answers(study: Study, value: int = 6, **others: Any) -> dict[str, Any]:
    """Answers to the paper's survey."""
    items = ("control", "wanted", "quickly", "like")
    answers = {f"{label}/{item}": value for label in study.labels for item in items}
    return {**answers, "prefer": value, **others}


def open_store(tmp_path: Path, **changes: Any) -> Store:
    """A store of the paper's study in an empty folder."""
    return Store(paper(**changes), tmp_path / "sessions")
