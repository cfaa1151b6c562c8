"""The protocol as a state machine: what follows what, what is refused, what counts."""

import msgspec
import pytest

from app.study.errors import ProtocolError
from app.study.events import (
    Answered,
    AnyEvent,
    AttemptEnded,
    Consented,
    Drafted,
    Excluded,
    ExtraAsked,
    Left,
    Passed,
    Redone,
    Returned,
    Skipped,
    from_line,
    to_detail,
)
from app.study.plan import make_plan
from app.study.protocol import State, apply, fold, initial, is_last_chance
from tests.study.builders import OBJECTS, advance, attempt, fast_plan, paper, start, until


def kinds(state: State) -> list[str]:
    """The steps a participant sees who does everything well."""
    seen = [state.step.kind]
    while state.step.kind != "done":
        state = advance(state)
        seen.append(state.step.kind)
    return seen


def test_a_fast_participant_sees_every_step_once():
    """Background to done, one training trial a method, three trials a method, one switch."""
    assert kinds(start()) == (
        ["background", "device", "instructions", "training", "training", "instructions"]
        + ["trial"] * 3
        + ["switch"]
        + ["trial"] * 3
        + ["survey", "debrief", "done"]
    )


def test_the_papers_participant_trains_freely_then_every_object_with_each_method():
    """Without `fast`: free practice, six training trials, the offer of more."""
    plan = make_plan(paper(), OBJECTS, 1, 0)
    training = [s for s in plan.steps if s.kind == "training"]
    assert [s.page for s in training] == ["free", *[""] * 6, "extra"]
    for place in (0, 1):
        tasks = [s.task for s in training if s.task and s.task.place == place]
        assert {t.target for t in tasks} == set(OBJECTS)
        assert {t.label for t in tasks} == {f"method{place + 1}"}
    assert plan.order == ("policy", "blend")


def test_recorded_trials_have_one_object_order_and_one_layout_for_both_methods():
    """So that the comparison within a participant is fair."""
    for cell in (0, 1):
        tasks = [s.task for s in fast_plan(cell, 3).steps if s.kind == "trial" and s.task]
        first, second = tasks[:3], tasks[3:]
        assert [t.target for t in first] == [t.target for t in second]
        assert [t.seed for t in first] == [t.seed for t in second]
        assert {t.condition for t in first} != {t.condition for t in second}


def test_a_failed_trial_is_repeated_and_stays_on_record():
    """Failures count up to the most attempts; the good attempt is the one that enters."""
    state = until(start(), "trial")
    index = state.index
    for outcome in ("knocked_over", "closed_on_nothing", "interrupted"):
        state = attempt(state, outcome)
        assert state.index == index
    state = attempt(state, "grasped")
    assert state.index == index + 1
    assert [a.started.attempt for a in state.attempts[-4:]] == [1, 2, 3, 4]
    assert state.counted()[index] is state.attempts[-1]


def test_the_most_attempts_end_a_trial_without_a_counted_one():
    """After five failures it goes on; an interruption is none of them."""
    state = until(start(max_attempts=2), "trial")
    index = state.index
    state = attempt(attempt(state, "interrupted"), "timeout")
    assert state.index == index
    state = attempt(state, "timeout")
    assert state.index == index + 1
    assert index not in state.counted()


@pytest.mark.parametrize(
    "event",
    [
        Consented(version="1", digest="", cell=0, slot=0),
        Passed(page="instructions start"),
        Answered(page="survey", values={}),
        Answered(page="device", values={}),
        AttemptEnded(index=4, attempt=1, trial=1, outcome="grasped"),
        ExtraAsked(place=0),
        Redone(index=4),
        Skipped(index=5),
        Returned(page="paper"),
    ],
)
def test_what_does_not_fit_the_step_is_refused(event: AnyEvent):
    """Replayed, skipped and foreign submissions raise, and the state is the same object."""
    state = start()
    with pytest.raises(ProtocolError):
        apply(state, event)
    assert state == start()


def test_nothing_is_accepted_before_consent_or_after_the_end():
    """Consent first; done, excluded and withdrawn are final."""
    with pytest.raises(ProtocolError):
        apply(initial(fast_plan(), 5), Answered(page="background", values={}))
    done = until(start(), "done")
    assert done.status == "completed"
    excluded = apply(start(), Excluded(reason="prior_exposure is yes"))
    left = apply(start(), Left())
    assert (excluded.step.page, left.step.page) == ("excluded", "withdrawn")
    for state in (done, excluded, left):
        with pytest.raises(ProtocolError):
            apply(state, Passed(page="debrief"))


def test_an_attempt_ends_only_as_the_one_that_runs():
    """A late or doubled end of another log changes nothing."""
    state = attempt(until(start(), "trial"), outcome="", trial=7)
    for trial, number in ((6, 1), (7, 2)):
        with pytest.raises(ProtocolError):
            ended = AttemptEnded(index=state.at, attempt=number, trial=trial, outcome="grasped")
            apply(state, ended)
    assert state.running is not None


def test_further_training_is_bounded_and_repeated_only_when_interrupted():
    """A failed extra trial is over; an interrupted one is done again."""
    study = paper()
    study = study.model_copy(
        update={"training": study.training.model_copy(update={"extra": 1, "free_s": 0})}
    )
    state = until(start(make_plan(study, OBJECTS, 0, 0)), "training", "extra")
    state = apply(state, ExtraAsked(place=1))
    assert state.task is not None and state.task.label == "method2"
    state = attempt(state, "interrupted")
    assert state.extra == 1
    state = attempt(state, "timeout")
    assert state.extra == -1 and state.step.page == "extra"
    with pytest.raises(ProtocolError):
        apply(state, ExtraAsked(place=0))
    assert advance(state).step.kind == "instructions"


def test_a_trial_can_be_done_again_later_and_the_first_one_no_longer_counts():
    """The experimenter's redo: back for one trial, then on where it was."""
    state = until(start(), "switch")
    index = next(i for i, s in enumerate(state.plan.steps) if s.kind == "trial")
    state = apply(state, Redone(index=index))
    assert state.step.kind == "trial" and index not in state.counted()
    state = attempt(state, "grasped")
    assert state.step.kind == "switch"
    assert state.counted()[index].started.attempt == 2


def test_surveys_can_be_changed_from_the_page_after_them():
    """Back from debriefing, with the answers as they were."""
    state = until(start(), "survey")
    state = apply(state, Answered(page="paper", values={"prefer": 3}))
    state = apply(state, Returned(page="paper"))
    assert state.step.kind == "survey" and state.drafts["paper"] == {"prefer": 3}
    state = apply(state, Answered(page="paper", values={"prefer": 5}))
    assert state.answers["paper"] == {"prefer": 5}


def test_events_survive_their_file_and_fold_to_the_same_state():
    """What is read back is what was written; lines of other rooms are passed over."""
    events = [
        Consented(version="1", digest="d", cell=0, slot=0, test=True, fast=True),
        Drafted(page="background", values={"gender": "male"}),
        Answered(page="background", values={"gender": "male", "n": 3}),
    ]
    lines = [{"name": "protocol", "wall_s": 1.0, **to_detail(event)} for event in events]
    read = [from_line(msgspec.json.decode(msgspec.json.encode(line))) for line in lines]
    assert read == events
    assert from_line({"name": "worker_start", "pid": 1}) is None
    once = fold(initial(fast_plan(), 5), events)
    assert once == fold(initial(fast_plan(), 5), [e for e in read if e is not None])
    assert once.drafts == {}


def test_a_person_is_told_whether_a_failed_trial_comes_again():
    """The last of the most attempts, and further training, are not repeated."""
    state = until(start(max_attempts=2), "trial")
    assert not is_last_chance(state)
    state = attempt(attempt(state, "interrupted"), "timeout")
    assert is_last_chance(attempt(state, outcome=""))
    after = attempt(state, "timeout")
    assert after.index == state.index + 1 and not is_last_chance(after)
