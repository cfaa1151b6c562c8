"""The world without physics: the hand moves as commanded, and grasps by pose."""

import numpy as np
import pytest

from app.core import Pose
from app.robot.scene import Scene
from app.session.kinematic_world import GRASP_DISTANCE_M, HIGHEST_M, LOWEST_M, KinematicWorld


def closed_at(scene: Scene, goal: str, offset: np.ndarray, instructed: str = "glass") -> str:
    """Outcome of closing the hand beside a target of this goal."""
    world = KinematicWorld(scene)
    world.begin(instructed)
    goals = world.goals()
    row = int(goals.offsets[goals.names.index(goal)])
    world._pose = Pose(goals.positions[row] + offset, goals.quaternions[row])
    world.close_hand()
    world.step(np.zeros(6))
    verdict = world.judge()
    assert verdict.hand == "done"
    return verdict.outcome


def test_the_hand_moves_as_commanded(scene: Scene):
    """Position and orientation follow the twist, the rotation on the left."""
    world = KinematicWorld(scene)
    before = world.hand_pose()
    for _ in range(100):
        world.step(np.array([0.05, -0.02, 0.01, 0.0, 0.0, 0.3]))
    after = world.hand_pose()
    assert after.position == pytest.approx(before.position + [0.05, -0.02, 0.01], abs=1e-12)
    w, x, y, z = before.quaternion
    c, s = np.cos(0.15), np.sin(0.15)
    turned = np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])
    assert after.quaternion == pytest.approx(turned, abs=1e-12)


def test_the_hand_stays_in_its_box(scene: Scene):
    """However long it is pushed."""
    world = KinematicWorld(scene)
    for sign, height in ((-1.0, LOWEST_M), (1.0, HIGHEST_M)):
        for _ in range(600):
            world.step(sign * np.array([0.4, 0.4, 0.4, 0.0, 0.0, 0.0]))
        assert world.hand_pose().position[2] == height


def test_grasps_are_judged_by_pose(scene: Scene):
    """Within the tolerance of a target of the object that was asked for, or not."""
    inside = np.array([0.0, 0.0, 0.9 * GRASP_DISTANCE_M])
    assert closed_at(scene, "glass", inside) == "grasped"
    assert closed_at(scene, "block", inside) == "wrong_object"
    assert closed_at(scene, "glass", np.array([0.0, 0.0, 0.3])) == "closed_on_nothing"


def test_the_seed_draws_the_layout(scene: Scene):
    """Equal seeds, equal layouts; not all seeds are equal."""
    layouts = {tuple(KinematicWorld(scene, seed).snapshot().object_poses) for seed in range(12)}
    again = tuple(KinematicWorld(scene, 3).snapshot().object_poses)
    assert 1 < len(layouts) <= 6
    assert again in layouts
