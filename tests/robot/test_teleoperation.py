"""A person who only translates a level hand can grasp every object from every place."""

import itertools

import numpy as np
import pytest

from app.robot import Simulation, load_scene, object_height
from tests.robot.driving import Rig, level_way


def _grasp_by_translation(scene_name: str, layout: tuple[int, ...], goal: str) -> Rig:
    scene = load_scene(scene_name)
    rig = Rig(scene, Simulation(scene, layout=layout), goal)
    index = scene.object_index(goal)
    point = rig.sim.object_poses()[index, :3]
    height = min(0.06, object_height(scene.objects[index]) - 0.02)
    assert rig.go(level_way(point, height)), (rig.monitor.outcome, rig.sim.hand_pose())
    rig.grasp()
    return rig


@pytest.mark.parametrize("layout", list(itertools.permutations(range(3))), ids=str)
@pytest.mark.parametrize("goal", ["canteen", "block", "glass"])
def test_every_object_from_every_place_of_the_default_scene(
    layout: tuple[int, ...], goal: str
) -> None:
    """Straight lines at most 0.2 m/s fast, no turning, then close: grasped and still level."""
    rig = _grasp_by_translation("default", layout, goal)
    assert rig.monitor.outcome == "grasped"
    level = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])
    angle = 2.0 * np.arccos(min(1.0, abs(float(rig.sim.hand_pose().quaternion @ level))))
    assert np.degrees(angle) < 2.0


@pytest.mark.parametrize("layout", list(itertools.permutations(range(2))), ids=str)
@pytest.mark.parametrize("goal", ["canteen", "glass"])
def test_both_objects_in_line(layout: tuple[int, ...], goal: str) -> None:
    """The far one too, beside the near one."""
    assert _grasp_by_translation("in-line", layout, goal).monitor.outcome == "grasped"


@pytest.mark.parametrize("turn", range(5))
@pytest.mark.parametrize("goal", ["canteen", "block", "glass", "can", "carton"])
def test_every_object_from_every_place_of_the_clutter(turn: int, goal: str) -> None:
    """Each of the five objects at each of the five places."""
    layout = tuple((i + turn) % 5 for i in range(5))
    assert _grasp_by_translation("clutter", layout, goal).monitor.outcome == "grasped"
