"""The physics: the same arm for MuJoCo and Pinocchio, and the same numbers every time."""

import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from app.core.types import Array
from app.robot import Kinematics, RobotError, Scene, SceneError, Simulation, load_scene
from app.robot.arm import JOINT_HIGH, JOINT_LOW

ROOT = Path(__file__).parents[2]


def _scripted_ctrl(sim: Simulation, ticks: int) -> list[Array]:
    """A movement that pushes objects over: contacts, friction and all."""
    start = sim.data.ctrl.copy()
    time = 0.01 * np.arange(ticks)
    sweep = np.zeros((ticks, 8))
    sweep[:, 0] = 0.5 * np.sin(2.0 * time)
    sweep[:, 1] = 0.45 * np.minimum(time, 1.0)
    sweep[:, 3] = -0.99 * np.minimum(time, 1.0)
    sweep[:, 5] = 0.53 * np.minimum(time, 1.0)
    sweep[:, 7] = 0.05 * (time > 1.0)
    return list(start + sweep)


def _digest(sim: Simulation, ctrl: list[Array]) -> str:
    digest = hashlib.sha256()
    for row in ctrl:
        sim.step(row)
        digest.update(sim.get_state().tobytes())
    return digest.hexdigest()


def test_mujoco_and_pinocchio_agree_on_the_hand(scene: Scene) -> None:
    """Both read arm.xml; the pose of `ee` is the same to rounding anywhere in the joint range."""
    sim, kin = Simulation(scene), Kinematics(scene)
    rng = np.random.default_rng(3)
    for q in rng.uniform(JOINT_LOW, JOINT_HIGH, (200, 7)):
        sim.put_arm(q)
        ours, theirs = sim.hand_pose(), kin.hand_pose(q)
        assert np.abs(ours.position - theirs.position).max() < 1e-13
        assert abs(abs(ours.quaternion @ theirs.quaternion) - 1.0) < 1e-13


def test_the_jacobian_is_the_derivative_of_the_hand_pose(scene: Scene) -> None:
    """Against central differences of MuJoCo's site position, at random joint positions."""
    sim, kin = Simulation(scene), Kinematics(scene)
    rng = np.random.default_rng(4)
    for q in rng.uniform(JOINT_LOW, JOINT_HIGH, (20, 7)):
        jacobian = kin.jacobian(q)
        for joint in range(7):
            ends = []
            for sign in (1.0, -1.0):
                moved = q.copy()
                moved[joint] += sign * 1e-6
                sim.put_arm(moved)
                ends.append(sim.hand_pose().position)
            assert np.allclose((ends[0] - ends[1]) / 2e-6, jacobian[:3, joint], atol=1e-8)


def test_the_hand_starts_level_in_the_middle_and_clear_of_everything() -> None:
    """In every scene: pointing along +x, at y ≈ 0, 0.2 to 0.3 m up, no contact with the arm."""
    for name in ("default", "clutter", "in-line"):
        sim = Simulation(load_scene(name))
        pose = sim.hand_pose()
        assert np.allclose(pose.quaternion, [np.sqrt(0.5), 0, np.sqrt(0.5), 0], atol=1e-6)
        assert abs(pose.position[1]) < 0.005 and 0.2 < pose.position[2] < 0.3
        first_object = min(sim.model.geom_bodyid[np.array(sim.geom_object) >= 0])
        arm = (sim.model.geom_bodyid > 0) & (sim.model.geom_bodyid < first_object)
        assert not arm[sim.data.contact.geom].any()


def test_a_resting_world_stays_at_rest(scene: Scene) -> None:
    """Two seconds at the start pose: the arm does not sag, the objects do not creep."""
    sim = Simulation(scene)
    hand, objects = sim.hand_pose().position, sim.object_poses()
    ctrl = sim.data.ctrl.copy()
    for _ in range(200):
        sim.step(ctrl)
    assert np.abs(sim.hand_pose().position - hand).max() < 1e-5
    assert np.abs(sim.object_poses() - objects).max() < 5e-5


def test_logged_ctrl_gives_the_same_bits_again(scene: Scene) -> None:
    """From the start, and from a state in the middle of contacts, also in another object."""
    sim = Simulation(scene, seed=5)
    ctrl = _scripted_ctrl(sim, 250)
    start = sim.get_state()
    first = _digest(sim, ctrl)
    assert np.abs(sim.object_poses()[:, 2]).max() > 1e-3  # something was really hit
    sim.set_state(start)
    assert _digest(sim, ctrl) == first

    other = Simulation(scene)  # another layout before; the state brings its own
    other.set_state(start)
    for row in ctrl[:150]:
        other.step(row)
    middle = other.get_state()
    rest = _digest(other, ctrl[150:])
    sim.set_state(middle)
    assert _digest(sim, ctrl[150:]) == rest


def test_another_process_gives_the_same_bits_and_the_same_model(scene: Scene) -> None:
    """The model's hash and every state of a run with contacts, in a fresh interpreter."""
    script = (
        "from app.robot import Simulation, load_scene\n"
        "from tests.robot.test_simulation import _digest, _scripted_ctrl\n"
        "sim = Simulation(load_scene('default'), seed=5)\n"
        "print(sim.model_hash, _digest(sim, _scripted_ctrl(sim, 250)))\n"
    )
    there = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split()
    sim = Simulation(scene, seed=5)
    assert there == [sim.model_hash, _digest(sim, _scripted_ctrl(sim, 250))]


def test_reading_the_world_changes_nothing(scene: Scene) -> None:
    """A run whose state is read every tick equals one that is not looked at."""
    seen, unseen = Simulation(scene), Simulation(scene)
    for row in _scripted_ctrl(seen, 150):
        seen.step(row)
        seen.hand_pose()
        seen.object_poses()
        seen.object_centres()
        seen.set_state(seen.get_state())
        unseen.step(row)
    assert (seen.get_state() == unseen.get_state()).all()


def test_the_hash_tells_models_apart_and_not_layouts(scene: Scene) -> None:
    """Another mass is another model; another order of the objects is the same one."""
    plain = Simulation(scene).model_hash
    assert Simulation(scene, layout=(2, 0, 1)).model_hash == plain
    heavier = scene.objects[1].model_copy(update={"mass_kg": 0.26})
    changed = scene.model_copy(update={"objects": (scene.objects[0], heavier, scene.objects[2])})
    assert Simulation(changed).model_hash != plain


def test_reset_puts_objects_at_the_places_of_the_layout(scene: Scene) -> None:
    """After any run, reset is as good as new."""
    sim = Simulation(scene)
    for row in _scripted_ctrl(sim, 100):
        sim.step(row)
    sim.reset((2, 0, 1))
    places = [(scene.places[i].x_m, scene.places[i].y_m) for i in (2, 0, 1)]
    assert np.array_equal(sim.object_poses()[:, :2], places)
    assert (sim.get_state() == Simulation(scene, layout=(2, 0, 1)).get_state()).all()


def test_geoms_have_names_and_say_what_they_are(scene: Scene) -> None:
    """The viewer draws by name and material: shell, joint, ring, pad; objects by their own."""
    model = Simulation(scene).model
    names = [model.geom(i).name for i in range(model.ngeom)]
    assert all(names) and len(set(names)) == len(names)
    assert {"canteen/body", "canteen/neck", "block/body", "glass/body", "table"} <= set(names)
    materials = {model.mat(i).name for i in range(model.nmat)}
    assert materials == {"shell", "joint", "ring", "pad"}


def test_masses_in_the_model_are_those_of_the_scene(scene: Scene) -> None:
    """Whatever an object is made of, its parts weigh what the file says."""
    model = Simulation(scene).model
    for item in scene.objects:
        assert abs(model.body(f"object/{item.name}").mass[0] - item.mass_kg) < 1e-12


def test_the_table_is_the_drawn_one(scene: Scene) -> None:
    """1.05 × 1.2 m from x = −0.15, its top at z = 0: the base stands on it."""
    geom = Simulation(scene).model.geom("table")
    assert np.allclose(geom.pos - geom.size, [-0.15, -0.6, -0.04])
    assert np.allclose(geom.pos + geom.size, [1.05, 0.6, 0.0])


def test_bad_values_are_refused_by_name(scene: Scene) -> None:
    """A wrong ctrl, a state of another model, a layout of another scene."""
    sim = Simulation(scene)
    for ctrl in (np.zeros(7), np.full(8, np.nan)):
        with pytest.raises(RobotError, match="8 finite numbers"):
            sim.step(ctrl)
    with pytest.raises(RobotError, match="finite numbers from get_state"):
        sim.set_state(sim.get_state()[:-1])
    with pytest.raises(SceneError, match="layout"):
        Simulation(scene, layout=(0, 1))
