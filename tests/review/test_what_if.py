"""What would have been: without changes it is the log itself; with changes it differs rightly."""

import dataclasses
from pathlib import Path

import msgspec
import numpy as np
import pytest

from app.core import preset
from app.review.closed_loop import closed_loop
from app.review.errors import ReviewError
from app.review.logged import changed_settings
from app.review.open_loop import looks_every_tick, open_loop, repeats
from app.review.opening import open_trial
from app.review.packing import unpack
from app.review.replay import Replay
from app.review.view import methods_at
from tests.review.conftest import Logs, Review


@pytest.fixture(scope="module")
def glass(logs: Logs) -> Replay:
    """Method, settings and assistance were switched in it, and the arm was held."""
    return Replay(open_trial(logs.path(logs.glass)))


@pytest.fixture(scope="module")
def block(logs: Logs) -> Replay:
    """Its goals were looked at in every tick, as in a live session."""
    return Replay(open_trial(logs.path(logs.block)))


def running(replay: Replay) -> np.ndarray:
    """Ticks in which the person steered."""
    return np.flatnonzero(replay.log.steps["phase"] == "running")


@pytest.mark.parametrize("name", ["glass", "block"])
def test_without_changes_the_open_loop_is_the_log(name: str, request: pytest.FixtureRequest):
    """Twists, belief and the assistance for a known goal repeat to the last bit."""
    replay: Replay = request.getfixturevalue(name)
    found = open_loop(replay, {})
    assert repeats(replay, found)
    rows, steps = running(replay), replay.log.steps
    assert np.array_equal(found.direct, steps["direct_twist"])
    assert np.array_equal(found.known[rows], steps["known_goal_assistance_twist"][rows])


def test_a_tampered_log_is_not_repeated(glass: Replay):
    """The last bit of one number is noticed."""
    found, row = open_loop(glass, {}), int(running(glass)[20])
    found.executed[row, 1] = np.nextafter(found.executed[row, 1], 1.0)
    assert not repeats(glass, found)


def test_another_method_on_the_same_states(glass: Replay):
    """Direct adds nothing; policy adds what the counterfactual of that moment says."""
    rows = running(glass)
    direct = open_loop(glass, {"method": "direct"})
    assert not direct.assistance[rows].any()
    # The belief does not depend on the method: the logged one holds for all of them.
    assert np.array_equal(direct.belief[rows], glass.log.steps["belief"][rows])
    step = int(rows[60])
    asked = methods_at(glass, step)
    policy = open_loop(glass, {"method": "policy"})
    given = glass.log.steps["direct_twist"][step]
    # Goals follow trembling objects in steps of 0.1 mm, which the moment's look does not know. For
    # a hand already turned as it should be, that decides about which axis it is turned.
    added = np.array(asked["policy"]) - given
    assert added[:3] == pytest.approx(policy.assistance[step, :3], abs=1e-5)
    assert np.linalg.norm(added[3:]) == pytest.approx(
        np.linalg.norm(policy.assistance[step, 3:]), abs=0.01
    )
    assert np.array(asked["direct"]) == pytest.approx(given)


def test_a_parameter_changes_what_it_is_of(glass: Replay):
    """Half the gain adds less to the same inputs; another predictor believes otherwise."""
    rows = running(glass)[:60]
    own = open_loop(glass, {}).assistance[rows]
    half = open_loop(glass, {"gain": 0.5}).assistance[rows]
    assert np.linalg.norm(half) < np.linalg.norm(own)
    other = open_loop(glass, {"predictor": "paper"}).belief[running(glass)]
    assert not np.array_equal(other, glass.log.steps["belief"][running(glass)])
    assert other.sum(axis=1) == pytest.approx(1.0)


def test_how_goals_were_looked_at_is_found_out(glass: Replay, block: Replay):
    """Either way repeats its own log; what is found is a way that does."""
    for replay in (glass, block):
        assert repeats(replay, open_loop(replay, {}, every_tick=looks_every_tick(replay)))


def test_without_changes_the_closed_loop_is_the_log(glass: Replay, block: Replay):
    """Every field of every step, through switches, hold, grasp and lift."""
    for replay in (glass, block):
        rerun = closed_loop(replay, {}, replay.n_steps)
        assert rerun.parts_at is None and rerun.refused == []
        assert rerun.outcome == "grasped" and rerun.grasped_object == replay.header.instructed_goal
        for step, record in enumerate(rerun.records):
            assert record == replay.record(step)


def test_a_closed_loop_parts_where_it_is_told_to(block: Replay):
    """Up to the moment nothing changes; after it the hand goes elsewhere."""
    first = int(running(block)[40])
    rerun = closed_loop(block, {"enabled": False}, first)
    assert rerun.parts_at is None
    for step in range(first):
        assert rerun.records[step] == block.record(step)
    assert rerun.records[first].enabled is False
    last = rerun.records[int(running(block)[-1])].hand_position_m
    assert np.linalg.norm(np.subtract(last, block.pose(int(running(block)[-1])).position)) > 1e-3


def test_a_log_that_other_code_made_says_where_it_parts(block: Replay, copy_of_block: Replay):
    """A hand that stands a micrometre off at one step: re-simulation names the step."""
    step = int(running(block)[10])
    rerun = closed_loop(copy_of_block, {}, block.n_steps, n_steps=step + 5)
    assert rerun.parts_at == step


@pytest.fixture
def copy_of_block(logs: Logs) -> Replay:
    """The block's trial with a changed step."""
    replay = Replay(open_trial(logs.path(logs.block)))
    changed = replay.log.steps["hand_position_m"].copy()
    changed[int(running(replay)[10]), 0] += 1e-6
    replay.log.steps["hand_position_m"] = changed
    return replay


def test_another_scene_cannot_be_set_up(logs: Logs):
    """A log whose start is not what this program makes of scene and seed is refused, and why."""
    log = open_trial(logs.path(logs.block))
    state = [*log.header.start_state]
    state[10] += 0.01
    header = msgspec.structs.replace(log.header, start_state=state, model_hash="0" * 64)
    with pytest.raises(ReviewError, match="physics model is 000000000000"):
        open_loop(Replay(dataclasses.replace(log, header=header)), {})


def test_a_method_brings_its_defaults_along():
    """As on the live page: what yielding needs comes with it, an explicit wish goes first."""
    policy = preset("default", method="policy")
    assert changed_settings(policy, {"method": "yielding"}) == preset("default", method="yielding")
    assert changed_settings(policy, {"method": "blend", "gain": 0.5}).gain == 0.5
    with pytest.raises(ReviewError, match="gain"):
        changed_settings(policy, {"gain": -1})


def test_both_loops_over_the_wire(review: Review, logs: Logs):
    """The page's two questions, answered in curves that carry what was asked and the caveat."""
    url = f"/api/review/trial/{logs.block}/what-if"
    answer = review.act("POST", url, {"loop": "open", "changes": {"method": "direct"}})
    assert answer.status_code == 200, answer.text
    meta, arrays = unpack(answer.content)
    assert meta["changes"] == {"method": "direct"} and not arrays["assistance.0"].any()
    replay = Replay(open_trial(logs.path(logs.block)))
    first = int(running(replay)[30])
    body = {"loop": "closed", "changes": {"method": "direct"}, "step": first}
    meta, arrays = unpack(review.act("POST", url, body).content)
    assert meta["first"] == first and meta["parts_at"] is None
    assert "would have reacted" in meta["caveat"] and len(meta["path"]) % 3 == 0
    logged = replay.log.steps["assistance_twist"][:first, 0].astype(np.float32)
    assert np.array_equal(arrays["assistance.0"][:first], logged)
    assert not arrays["assistance.0"][first:].any()
    assert Path(logs.path(logs.block)).is_file()
