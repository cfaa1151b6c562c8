"""A person at the sticks grasps every object, in physics, under every published method."""

import pytest

from app.core import preset
from app.core.measures import compute_measures
from app.recording.schema import StepRecord
from app.robot.scene import Scene
from app.session.physics_world import PhysicsWorld
from app.session.trial import Trial
from tests.session.person import Person, finish


def _column(records: list[StepRecord], name: str) -> list:
    return [getattr(record, name) for record in records]


@pytest.mark.parametrize("goal", ["canteen", "block", "glass"])
@pytest.mark.parametrize("method", ["direct", "blend", "policy"])
def test_a_person_grasps_each_object(scene: Scene, method: str, goal: str):
    """Steering by eye alone ends with the instructed object in the hand."""
    trial = Trial(PhysicsWorld(scene, 1), preset("default", method=method), goal, seed=1)
    records = finish(trial, Person(goal))
    assert trial.outcome == "grasped", f"{trial.outcome} at {records[-1].hand_position_m}"
    assert trial.grasped_object == goal
    assert trial.summary().inferred_goal == goal
    phases = list(dict.fromkeys(_column(records, "phase")))
    assert phases == ["ready", "running", "closing", "lifting"]


def test_the_summary_says_what_the_measures_say(scene: Scene):
    """Duration and input of the summary equal those measured from the recorded steps."""
    trial = Trial(PhysicsWorld(scene), preset("default", method="policy"), "glass")
    records = finish(trial, Person("glass"))
    names = ("phase", "input_norm", "direct_twist", "assistance_twist", "executed_twist", "belief")
    columns = {name: _column(records, name) for name in names}
    measures = compute_measures(columns, true_goal=2, dt=trial.dt)
    summary = trial.summary()
    assert summary.duration_s == pytest.approx(measures.time_s, abs=1e-9)
    assert summary.input_s == pytest.approx(measures.input_s, abs=1e-9)
    assert records[-1].input_s == summary.input_s
    assert summary.duration_s > 1.0
