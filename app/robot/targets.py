"""The targets κ of every object: a few well-spread grasps that work wherever the object stands."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.core.types import Array, Goals
from app.robot.errors import GraspError
from app.robot.grasps import candidates, mirrored
from app.robot.kinematics import Kinematics
from app.robot.reachability import ReachabilityCheck
from app.robot.rotations import left_matrices, matrices, quaternions
from app.robot.scene import Place, Scene
from app.robot.target_cache import cache_key, read_cache, write_cache

MAX_TARGETS = 20
METRES_PER_RADIAN = 0.1
"""How far apart two grasps count: |Δp| + 0.1 m/rad · angle."""


@dataclass(frozen=True, slots=True)
class GraspTargets:
    """Targets of all objects, each in its object's frame, in one flat array.

    Attributes:
        names: The objects' names in the scene's order.
        positions: Tool centre in the object's frame [m], shape (n_targets, 3).
        quaternions: Orientation in the object's frame, w x y z, shape (n_targets, 4).
        offsets: First target of each object and the end, shape (n_objects + 1,).
        owner: Object of each target, shape (n_targets,).
    """

    names: tuple[str, ...]
    positions: Array
    quaternions: Array
    offsets: npt.NDArray[np.int64]
    owner: npt.NDArray[np.int64]


def grasp_targets(scene: Scene) -> GraspTargets:
    """Targets of a scene's objects, from the cache on disk where that is possible.

    Raises:
        GraspError: If an object cannot be grasped at some place of the scene.
    """
    key = cache_key(scene)
    found = read_cache(key)
    if found is None:
        found = find_grasps(scene)
        write_cache(key, found)
    return _flat(scene, found)


def find_grasps(scene: Scene) -> list[Array]:
    """Per object the selected grasps T_object_ee, shape (n, 4, 4) each, without the cache.

    Raises:
        GraspError: If an object cannot be grasped at some place of the scene.
    """
    check = ReachabilityCheck(scene)
    return [_object_grasps(scene, check, index) for index in range(len(scene.objects))]


def goals_in_world(targets: GraspTargets, object_poses: Array) -> Goals:
    """The targets where their objects are now; quick enough for every tick.

    Args:
        targets: From `grasp_targets`.
        object_poses: x y z qw qx qy qz per object, world frame, shape (n_objects, 7).
    """
    turn = object_poses[:, 3:]
    rotation = matrices(turn)[targets.owner]
    positions = np.matmul(rotation, targets.positions[:, :, None])[:, :, 0]
    positions += object_poses[targets.owner, :3]
    quaternion = np.matmul(left_matrices(turn)[targets.owner], targets.quaternions[:, :, None])
    return Goals(targets.names, positions, quaternion[:, :, 0], targets.offsets)


def place_matrix(place: Place) -> Array:
    """T_world_object of an object that stands at a place, shape (4, 4)."""
    yaw = np.radians(place.yaw_degrees)
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    pose[:2, 3] = place.x_m, place.y_m
    return pose


def _object_grasps(scene: Scene, check: ReachabilityCheck, index: int) -> Array:
    """Filter an object's candidates at every place and thin them out, in mirrored pairs."""
    every = candidates(scene.objects[index])
    twins = _twins(every)
    start = Kinematics(scene).hand_pose(scene.start_joint_positions).quaternion
    turn = place_matrix(scene.places[0])[:3, :3].T @ matrices(start[None])[0]
    alive = _nearer_than_flipped(every[:, :3, :3], turn)
    alive &= alive[twins]
    for number, place in enumerate(scene.places):
        check.place(index, number)
        for i in np.flatnonzero(alive):
            # A candidate goes with its mirror image, so that neither side is favoured.
            if alive[i] and not check.reaches(place_matrix(place) @ every[i]):
                alive[[i, twins[i]]] = False
        if not alive.any():
            raise GraspError(
                f"scene {scene.name!r}: the arm cannot grasp {scene.objects[index].name!r} at place"
                f" {place.name!r} as at the places before it; valid: places 0.35 to 0.90 m in front"
                " of the base, clear of each other by a hand's width"
            )
    return every[_spread(every, twins, np.flatnonzero(alive), turn)]


def _nearer_than_flipped(rotations: Array, start: Array) -> npt.NDArray[np.bool_]:
    """Which of two grasps, 180° apart about the approach, is the one to keep.

    They are the same for the object; the hand starts closer to one of them.
    """
    flipped = rotations @ np.diag([-1.0, -1.0, 1.0])
    return _angles(rotations, start) <= _angles(flipped, start) + 1e-9


def _twins(grasps: Array) -> npt.NDArray[np.int64]:
    """Index of each grasp's mirror image, which may be the grasp itself."""
    flat, image = grasps.reshape(len(grasps), 16), mirrored(grasps).reshape(len(grasps), 16)
    return np.array([int(np.abs(flat - row).max(axis=1).argmin()) for row in image])


def _spread(
    grasps: Array, twins: npt.NDArray[np.int64], pool: npt.NDArray[np.int64], start: Array
) -> npt.NDArray[np.int64]:
    """Farthest-point sampling over mirrored pairs, from the grasp closest to the start's."""
    angles = np.round(_angles(grasps[pool, :3, :3], start), 6)
    chosen: list[int] = []
    gap = np.full(len(grasps), np.inf)
    upcoming = int(pool[np.argmin(angles)])
    while len(chosen) < min(MAX_TARGETS, len(pool)):
        for index in dict.fromkeys((upcoming, int(twins[upcoming]))):
            chosen.append(index)
            distance = np.linalg.norm(grasps[:, :3, 3] - grasps[index, :3, 3], axis=1)
            distance += METRES_PER_RADIAN * _angles(grasps[:, :3, :3], grasps[index, :3, :3])
            gap = np.minimum(gap, distance)
        gap[chosen] = -1.0
        upcoming = int(pool[np.argmax(gap[pool])])
        if gap[upcoming] < 0.0:
            break
    return np.array(sorted(chosen))


def _angles(rotations: Array, reference: Array) -> Array:
    """Angle between each rotation and a reference [rad], shape (n,)."""
    trace = np.einsum("nij,ij->n", rotations, reference)
    return np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0))


def _flat(scene: Scene, grasps: list[Array]) -> GraspTargets:
    every = np.concatenate(grasps)
    counts = [len(part) for part in grasps]
    return GraspTargets(
        names=scene.object_names,
        positions=every[:, :3, 3].copy(),
        quaternions=quaternions(every[:, :3, :3]),
        offsets=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        owner=np.repeat(np.arange(len(counts)), counts).astype(np.int64),
    )
