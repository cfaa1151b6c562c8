"""Twelve scripted trials, each told apart from the others."""

import numpy as np
import pytest

from app.core.types import Array
from app.robot import HandController, OutcomeMonitor, Scene, SceneError, Simulation
from tests.robot.driving import Rig, level_way


def _rig(scene: Scene, goal: str) -> Rig:
    return Rig(scene, Simulation(scene), goal)


def _spot(rig: Rig, name: str) -> Array:
    return rig.sim.object_poses()[rig.scene.object_index(name), :3]


@pytest.mark.parametrize("name", ["canteen", "block", "glass"])
def test_the_instructed_object_lifted_is_grasped(scene: Scene, name: str) -> None:
    """Cases 1 to 3; the object is still between the pads 3 s later, slipped by less than 1 mm."""
    rig = _rig(scene, name)
    assert rig.go(level_way(_spot(rig, name), 0.06))
    assert rig.grasp() == "grasped"
    assert rig.monitor.gripped_name == name and rig.hand.phase == "done"
    for _ in range(50):
        rig.tick(np.zeros(6))  # the lift comes to rest
    held = _spot(rig, name) - rig.sim.hand_pose().position
    for _ in range(300):
        rig.tick(np.zeros(6))
    assert np.linalg.norm(_spot(rig, name) - rig.sim.hand_pose().position - held) < 0.001


def test_another_object_lifted_is_the_wrong_one(scene: Scene) -> None:
    """Case 4."""
    rig = _rig(scene, "glass")
    assert rig.go(level_way(_spot(rig, "canteen"), 0.06))
    assert rig.grasp() == "wrong_object"
    assert rig.monitor.gripped_name == "canteen"


def test_closing_in_the_air_is_closing_on_nothing(scene: Scene) -> None:
    """Case 5."""
    rig = _rig(scene, "block")
    assert rig.grasp() == "closed_on_nothing"
    assert rig.monitor.gripped_name == ""


def test_closing_in_front_of_the_object_is_closing_on_nothing(scene: Scene) -> None:
    """Case 6: 6 cm too short, as happens when one misjudges depth."""
    rig = _rig(scene, "block")
    way = level_way(_spot(rig, "block"), 0.06)
    way[-1] = way[-1] - [0.065, 0.0, 0.0]
    assert rig.go(way)
    assert rig.grasp() == "closed_on_nothing"


def test_fingers_that_are_blocked_without_an_object_are_a_bad_grip(scene: Scene) -> None:
    """Case 7: something stops the fingers half-way, and it is no object."""
    rig = _rig(scene, "block")
    rig.finger_limit = 0.025
    assert rig.grasp() == "bad_grip"
    assert rig.monitor.gripped_name == ""


def test_an_object_lost_in_the_lift_is_a_bad_grip(scene: Scene) -> None:
    """Case 8: the fingers give way just as the lift begins."""
    rig = _rig(scene, "glass")
    assert rig.go(level_way(_spot(rig, "glass"), 0.06))
    rig.hand.close()
    for _ in range(300):
        rig.tick(np.zeros(6))
        if rig.hand.phase == "lifting":
            rig.finger_limit = 0.0
        if rig.monitor.outcome != "running":
            break
    assert rig.monitor.outcome == "bad_grip"


@pytest.mark.parametrize("name", ["canteen", "block", "glass"])
def test_a_sweep_above_the_centre_of_mass_knocks_it_over(scene: Scene, name: str) -> None:
    """Cases 9 to 11: the closed hand passes sideways through the upper part of the object."""
    rig = _rig(scene, name)
    x, y, _ = _spot(rig, name)
    side = 0.13 if y <= 0.0 else -0.13
    height = {"canteen": 0.13, "block": 0.085, "glass": 0.095}[name]
    before = np.array([x - 0.10, y + side, height])
    assert rig.go([np.array([0.54, y + side, 0.22]), before, before + [0.10, 0.0, 0.0]])
    assert not rig.go([np.array([x, y - side, height])])
    assert rig.monitor.outcome == "knocked_over"


def test_an_object_over_the_edge_fell_off(scene: Scene) -> None:
    """Case 12: the table ends beneath it."""
    rig = _rig(scene, "glass")
    columns = rig.sim.model.joint("object/glass").qposadr[0]
    rig.sim.data.qpos[columns : columns + 3] = [0.66, -0.64, 0.0]
    assert rig.wait(2.0) == "fell_off"


def test_standing_about_decides_nothing(scene: Scene) -> None:
    """Five seconds of an open hand at rest: still running."""
    rig = _rig(scene, "block")
    assert rig.wait(5.0) == "running"
    assert rig.hand.phase == "open"


def test_the_first_outcome_stays(scene: Scene) -> None:
    """What happens after the decision does not change it."""
    rig = _rig(scene, "block")
    assert rig.grasp() == "closed_on_nothing"
    columns = rig.sim.model.joint("object/glass").qposadr[0]
    rig.sim.data.qpos[columns + 2] = -0.5
    for _ in range(20):
        assert rig.tick(np.zeros(6)) == "closed_on_nothing"


def test_opening_gives_the_arm_back_and_closing_works_again(scene: Scene) -> None:
    """Close, open before anything is decided, drive on, grasp."""
    rig = _rig(scene, "block")
    rig.hand.close()
    assert rig.wait(0.2) == "running" and rig.hand.phase == "closing"
    rig.hand.open()
    assert rig.wait(0.6) == "running"
    assert (rig.sim.finger_positions < 0.002).all()
    assert rig.go(level_way(_spot(rig, "block"), 0.06))
    assert rig.grasp() == "grasped"


def test_the_lift_is_short_and_comes_to_rest() -> None:
    """8 cm up, at most 0.12 m/s, at most 0.4 m/s² — also at the top."""
    hand = HandController()
    assert hand.command().twist is None
    hand.phase = "lifting"
    speeds = [0.0]
    for _ in range(200):
        twist = hand.command().twist
        assert twist is not None and not np.delete(twist, 2).any()
        speeds.append(float(twist[2]))
    assert max(speeds) <= 0.12 and speeds[-1] < 1e-3
    assert np.abs(np.diff(speeds)).max() <= 0.4 * 0.01 + 1e-9
    assert abs(sum(speeds) * 0.01 - 0.08) < 1e-3


def test_an_unknown_goal_is_refused_by_name(scene: Scene) -> None:
    """The message lists what there is."""
    with pytest.raises(SceneError, match="'vase'; valid: canteen, block, glass"):
        OutcomeMonitor(scene, "vase")
