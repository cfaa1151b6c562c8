"""Simulated users on the live page's own trial."""

from app.core import preset
from app.robot.scene import Scene
from app.session.commands import Command
from app.session.kinematic_world import KinematicWorld
from app.session.trial import Trial
from app.simulate.attract import Attract


def test_one_user_after_another_does_the_trials(scene: Scene):
    """Through `step` with its records, the start delay and the pause after the outcome."""
    attract, inputs = Attract(seed=3), set()
    for number, goal in enumerate(("glass", "canteen")):
        trial = Trial(KinematicWorld(scene, seed=number), preset("default"), goal)
        while not attract.wants_next(trial):
            user_input, close = attract.act(trial)
            if trial.phase == "ready":
                assert user_input.axes == (0.0, 0.0, 0.0, 0.0)
            inputs.add(user_input.axes)
            trial.step(user_input, [Command("grasp")] if close else [])
            assert trial.tick < 6000
        assert trial.outcome == "grasped"
    assert len(inputs) > 50
