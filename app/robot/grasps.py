"""Candidate grasps of an object: its task-space regions, sampled, in the object's frame.

A grasp is a pose of `ee` (z: approach, y: closing direction). Regions: side grasps over yaw ×
height × pitch for round bodies, the same on the faces of boxes, and grasps from above.
"""

from collections.abc import Iterator

import numpy as np

from app.core.types import Array
from app.robot.objects import AnyObject, Block, Box, Canteen, object_height
from app.robot.scene import MAX_GRASP_WIDTH

SIDE_YAWS = np.radians(np.arange(-180.0, 180.0, 15.0))
PITCHES = np.radians([0.0, 20.0, 40.0])
TOP_YAWS = np.radians(np.arange(0.0, 180.0, 30.0))
LOWEST = 0.045  # [m]: the wrist's radius, and a little air over the table
BELOW_RIM = 0.018  # [m]: half a pad's width stays below the rim
TOP_DEPTH = 0.022  # [m] of the tool centre below the rim in a grasp from above
MAX_DEPTH = 0.035  # [m] of the tool centre behind the face it approaches


def candidates(item: AnyObject) -> Array:
    """All sampled grasps T_object_ee, homogeneous, shape (n, 4, 4).

    Every set is closed under the mirror y → −y, and every grasp comes with the one turned by 180°
    about the approach (the same two contact points).
    """
    if isinstance(item, Block | Box):
        grasps = list(_box_grasps(item))
    else:
        grasps = list(_round_grasps(item))
    return np.array([turned for grasp in grasps for turned in (grasp, grasp @ _FLIP)])


_FLIP = np.diag([-1.0, -1.0, 1.0, 1.0])


def mirrored(grasps: Array) -> Array:
    """The same grasps seen in the mirror y → −y of the object, shape (n, 4, 4).

    R' = M R M with M = diag(1, −1, 1): the hand is its own mirror image in its y.
    """
    mirror = np.diag([1.0, -1.0, 1.0, 1.0])
    return mirror @ grasps @ mirror


def _round_grasps(item: AnyObject) -> Iterator[Array]:
    height = object_height(item)
    if isinstance(item, Canteen):
        levels = [
            *_levels(item.body_height_m),
            item.body_height_m + max(0.5 * item.neck_height_m, 0.028),
        ]
    else:
        levels = _levels(height)
    for level in levels:
        for yaw in SIDE_YAWS:
            for pitch in PITCHES:
                yield _side(np.array([0.0, 0.0, level]), yaw, pitch)
    for yaw in TOP_YAWS:
        yield _top(np.array([0.0, 0.0, height - TOP_DEPTH]), yaw)


def _box_grasps(item: Block | Box) -> Iterator[Array]:
    depth, width, height = item.size_m
    for yaw in np.radians([0.0, 90.0, 180.0, -90.0]):
        along, across = (depth, width) if abs(np.cos(yaw)) > 0.5 else (width, depth)
        if across > MAX_GRASP_WIDTH:
            continue
        approach = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        back = max(0.5 * along - MAX_DEPTH, 0.0)
        for level in _levels(height):
            for pitch in PITCHES:
                for out in (0.0, 0.01):
                    yield _side(np.array([0.0, 0.0, level]) - (back + out) * approach, yaw, pitch)
    for yaw, along, across in ((0.0, depth, width), (0.5 * np.pi, width, depth)):
        if across > MAX_GRASP_WIDTH:
            continue
        for shift in (-0.25, 0.0, 0.25):
            offset = shift * along * np.array([np.cos(yaw), np.sin(yaw), 0.0])
            yield _top(np.array([0.0, 0.0, height - TOP_DEPTH]) + offset, yaw)


def _levels(height: float) -> list[float]:
    """Heights [m] for side grasps, from above the table to below the rim, about 15 mm apart."""
    low, high = LOWEST, height - BELOW_RIM
    if high <= low:
        return [max(high, 0.5 * height)]
    return np.linspace(low, high, max(2, 1 + round((high - low) / 0.015))).tolist()


def _side(position: Array, yaw: float, pitch: float) -> Array:
    """Approach along yaw, pitched down; the hand closes horizontally, its x axis downwards."""
    forward = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    approach = np.cos(pitch) * forward - np.sin(pitch) * np.array([0.0, 0.0, 1.0])
    return _pose(position, approach, np.array([-np.sin(yaw), np.cos(yaw), 0.0]))


def _top(position: Array, yaw: float) -> Array:
    """Approach straight down; the hand closes across yaw."""
    return _pose(position, np.array([0.0, 0.0, -1.0]), np.array([-np.sin(yaw), np.cos(yaw), 0.0]))


def _pose(position: Array, approach: Array, closing: Array) -> Array:
    pose = np.eye(4)
    pose[:3, 0] = np.cross(closing, approach)
    pose[:3, 1] = closing
    pose[:3, 2] = approach
    pose[:3, 3] = position
    return pose
