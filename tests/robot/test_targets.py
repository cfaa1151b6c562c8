"""Grasp targets: where they come from, where they follow their objects, how they are kept."""

import os
from pathlib import Path

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]
import pytest

from app.robot import (
    GraspError,
    GraspTargets,
    Scene,
    Simulation,
    goals_in_world,
    grasp_targets,
    load_scene,
)
from app.robot import targets as module
from app.robot.reachability import STAND_OFFS, ReachabilityCheck
from app.robot.rotations import matrices
from app.robot.target_cache import cache_folder, cache_key
from app.robot.targets import place_matrix
from tests.robot.driving import LEVEL, Rig


def test_each_object_has_sixteen_to_twenty_four_targets() -> None:
    """In every shipped scene, in the scene's order."""
    for name in ("default", "clutter", "in-line"):
        scene = load_scene(name)
        found = grasp_targets(scene)
        counts = np.diff(found.offsets)
        assert found.names == scene.object_names
        assert (counts >= 16).all() and (counts <= 24).all(), (name, counts)


def test_targets_are_fair_to_both_sides(scene: Scene, targets: GraspTargets) -> None:
    """The mirror image y → −y of every target is a target too."""
    mirror = np.diag([1.0, -1.0, 1.0])
    rotation = matrices(targets.quaternions)
    for index in range(len(scene.objects)):
        rows = slice(targets.offsets[index], targets.offsets[index + 1])
        points, turns = targets.positions[rows], rotation[rows]
        for point, turn in zip(points @ mirror, mirror @ turns @ mirror, strict=True):
            gap = np.abs(points - point).max(axis=1) + np.abs(turns - turn).max(axis=(1, 2))
            assert gap.min() < 1e-9


def test_a_level_hand_matches_one_target_of_each_object(targets: GraspTargets) -> None:
    """So that nobody has to turn the hand to be helped."""
    turns = matrices(targets.quaternions)
    for index in range(len(targets.names)):
        rows = slice(targets.offsets[index], targets.offsets[index + 1])
        assert np.abs(turns[rows] - LEVEL).max(axis=(1, 2)).min() < 1e-9


def test_no_two_targets_are_the_same(targets: GraspTargets) -> None:
    """Thinning out leaves them at least 8 mm or 0.08 rad apart."""
    turns = matrices(targets.quaternions)
    for first in range(len(turns)):
        for second in range(first):
            if targets.owner[first] == targets.owner[second]:
                apart = np.linalg.norm(targets.positions[first] - targets.positions[second])
                angle = np.arccos(
                    np.clip((np.trace(turns[first].T @ turns[second]) - 1) / 2, -1, 1)
                )
                assert apart + 0.1 * angle > 0.008


def test_every_target_is_reachable_and_clear_at_every_place(
    scene: Scene, targets: GraspTargets
) -> None:
    """Checked anew, 10 cm and 5 cm before the grasp and at it."""
    check = ReachabilityCheck(scene)
    turns = matrices(targets.quaternions)
    for row, owner in enumerate(targets.owner):
        grasp = np.eye(4)
        grasp[:3, :3], grasp[:3, 3] = turns[row], targets.positions[row]
        for number, place in enumerate(scene.places):
            check.place(int(owner), number)
            assert check.reaches(place_matrix(place) @ grasp)


def test_targets_follow_their_objects(scene: Scene, targets: GraspTargets) -> None:
    """T_world_target = T_world_object · T_object_target, against Pinocchio, for tumbled objects."""
    rng = np.random.default_rng(2)
    poses = rng.normal(size=(len(scene.objects), 7))
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    goals = goals_in_world(targets, poses)
    assert goals.names == scene.object_names
    assert (goals.offsets == targets.offsets).all()
    for row, owner in enumerate(targets.owner):
        w, x, y, z = poses[owner, 3:]
        body = pin.SE3(pin.Quaternion(w, x, y, z), poses[owner, :3])
        w, x, y, z = targets.quaternions[row]
        expected = body * pin.SE3(pin.Quaternion(w, x, y, z), targets.positions[row])
        w, x, y, z = goals.quaternions[row]
        assert np.allclose(goals.positions[row], expected.translation, atol=1e-12)
        found = pin.Quaternion(w, x, y, z)
        assert abs(found.norm() - 1.0) < 1e-12
        assert np.allclose(found.toRotationMatrix(), expected.rotation, atol=1e-12)


def test_the_cache_is_used_and_means_the_same(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """First found, then read; nothing but the one file stays in the folder."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    first = grasp_targets(scene)
    assert [path.name for path in cache_folder().iterdir()] == [f"grasps-{cache_key(scene)}.npz"]
    monkeypatch.setattr(module, "find_grasps", lambda _: pytest.fail("searched again"))
    again = grasp_targets(scene)
    assert (again.positions == first.positions).all()
    assert (again.quaternions == first.quaternions).all()


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 torn", b"nonsense"])
def test_a_damaged_cache_is_replaced(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes
) -> None:
    """Empty, torn, or something else altogether."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    cache_folder().mkdir()
    path = cache_folder() / f"grasps-{cache_key(scene)}.npz"
    path.write_bytes(content)
    assert len(grasp_targets(scene).names) == 3
    assert path.stat().st_size > 1000


def test_without_a_writable_cache_it_only_takes_longer(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The cache's place is taken by a file, which not even root can write into."""
    (tmp_path / "hindsight").write_text("not a folder", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert len(grasp_targets(scene).names) == 3
    assert os.listdir(tmp_path) == ["hindsight"]


def test_the_key_follows_what_grasps_depend_on(scene: Scene) -> None:
    """Geometry and places count; title and time limit do not."""
    key = cache_key(scene)
    assert cache_key(scene.model_copy(update={"title": "x", "time_limit_s": 9.0})) == key
    moved = scene.places[0].model_copy(update={"x_m": 0.65})
    assert cache_key(scene.model_copy(update={"places": (moved, *scene.places[1:])})) != key


def test_a_place_out_of_reach_is_named(scene: Scene) -> None:
    """A scene nobody could solve is refused before a trial begins."""
    away = scene.places[0].model_copy(update={"x_m": 0.85, "y_m": 0.55})
    unreachable = scene.model_copy(update={"places": (away, *scene.places[1:])})
    with pytest.raises(GraspError, match="'canteen' at place 'left'"):
        module.find_grasps(unreachable)


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("name", ["default", "in-line", "clutter"])
def test_every_target_at_every_place_succeeds_in_physics(name: str) -> None:
    """Approach along the last 10 cm, close, lift: grasped, without exception."""
    scene = load_scene(name)
    found = grasp_targets(scene)
    check = ReachabilityCheck(scene)
    n_places = len(scene.places)
    failed = []
    for turn in range(n_places):
        layout = tuple((i + turn) % n_places for i in range(len(scene.objects)))
        sim = Simulation(scene, layout=layout)
        start = sim.get_state()
        goals = goals_in_world(found, sim.object_poses())
        turns = matrices(goals.quaternions)
        for row, owner in enumerate(found.owner):
            check.place(int(owner), layout[owner])
            position, rotation = goals.positions[row], turns[row]
            grasp = np.eye(4)
            grasp[:3, :3], grasp[:3, 3] = rotation, position
            approach = check.path(grasp)
            assert approach is not None and len(approach) == len(STAND_OFFS)
            sim.set_state(start)
            sim.put_arm(approach[0])
            rig = Rig(scene, sim, scene.object_names[owner])
            if not rig.go_to_pose(position, rotation) or rig.grasp() != "grasped":
                failed.append((layout, scene.object_names[owner], row, rig.monitor.outcome))
    assert not failed
