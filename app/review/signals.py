"""The curves of a trial: what each panel beside the replay shows, as columns over its steps."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from app.core.types import Array
from app.review.packing import pack, window
from app.review.replay import Replay

COLUMNS = (
    *("step", "phase", "settings_id", "input_norm", "belief", "values", "q_values"),
    *("direct_twist", "assistance_twist", "known_goal_assistance_twist", "best_targets"),
    *("hand_position_m", "object_poses", "lateness_s", "round_trip_ms"),
)
"""The fields that curves and marks are made of: half of a record, which a long trial notices."""

AXES = ("x, away", "y, left", "z, up", "about x", "about y", "about z")
"""Dimensions of a twist in the world frame, as an operator would name them."""


@dataclass(frozen=True, slots=True)
class Curve:
    """One line of a panel.

    Attributes:
        array: Name of its column.
        name: In the legend.
        role: What its colour says: user, assist, known, line, or goal:<name>.
    """

    array: str
    name: str
    role: str

    def to_dict(self) -> dict[str, str]:
        """As the page reads it."""
        return {"array": self.array, "name": self.name, "role": self.role}


@dataclass(frozen=True, slots=True)
class Panel:
    """One plot: curves that share a unit."""

    key: str
    title: str
    unit: str
    curves: tuple[Curve, ...]

    def to_dict(self) -> dict[str, Any]:
        """As the page reads it."""
        curves = [curve.to_dict() for curve in self.curves]
        return {"key": self.key, "title": self.title, "unit": self.unit, "curves": curves}


@dataclass(frozen=True, slots=True)
class Signals:
    """All curves of a trial at full resolution.

    Attributes:
        panels: In the order they are shown.
        columns: Name → float32 numbers, (n_steps,) each.
    """

    panels: tuple[Panel, ...]
    columns: dict[str, Any]

    def pack(self, meta: dict[str, Any], first: int = 0, last: int = -1) -> bytes:
        """The answer for a range of steps, thinned to what a screen can show."""
        n_steps = len(self.columns["seconds"])
        first, end, stride = window(n_steps, first, last)
        # The last step is always there: the curves end where the timeline does.
        rows = np.unique(np.append(np.arange(first, end, stride), end - 1))
        thinned = {name: column[rows] for name, column in self.columns.items()}
        about = {"first": first, "end": end, "stride": stride, "n_steps": n_steps}
        panels = [panel.to_dict() for panel in self.panels]
        return pack({**meta, **about, "panels": panels}, thinned)


def make_signals(replay: Replay) -> Signals:
    """All curves of a trial."""
    steps, names = replay.log.steps, replay.header.goal_names
    columns: dict[str, Any] = {"seconds": replay.seconds, "step": steps["step"]}
    panels: list[Panel] = []

    def add(key: str, title: str, unit: str, curves: list[tuple[Curve, Array]]) -> None:
        columns.update({curve.array: column for curve, column in curves})
        panels.append(Panel(key, title, unit, tuple(curve for curve, _ in curves)))

    for index, axis in enumerate(AXES[:3]):
        add(f"twist-{index}", axis, "m/s", _twists(replay, index))
    product = np.einsum("ij,ij->i", steps["direct_twist"][:, :3], steps["assistance_twist"][:, :3])
    add("dot", "input · assistance", "m²/s²", [(Curve("dot", "dot product", "line"), product)])
    for key, title, unit, field in (
        ("belief", "Belief", "", "belief"),
        ("values", "V per goal", "nat", "values"),
        ("q-values", "Q per goal", "nat", "q_values"),
    ):
        curves = [Curve(f"{key}.{name}", name, f"goal:{name}") for name in names]
        add(key, title, unit, list(zip(curves, steps[field].T, strict=True)))
    height = (Curve("height", "height over the table", "line"), steps["hand_position_m"][:, 2])
    distances = [
        (Curve(f"distance.{name}", f"to {name}", f"goal:{name}"), column)
        for name, column in zip(names, distances_to_goals(replay).T, strict=True)
    ]
    add("distance", "Hand: height, distance to goals", "m", [height, *distances])
    for index, axis in enumerate(AXES[3:], 3):
        add(f"twist-{index}", axis, "rad/s", _twists(replay, index))
    late = (Curve("lateness", "loop lateness", "line"), 1000.0 * steps["lateness_s"])
    trip = (Curve("round-trip", "round trip", "known"), steps["round_trip_ms"])
    add("health", "Loop and link", "ms", [late, trip])
    columns["input_norm"] = steps["input_norm"]
    single = {name: np.asarray(column, dtype=np.float32) for name, column in columns.items()}
    return Signals(tuple(panels), single)


def _twists(replay: Replay, index: int) -> list[tuple[Curve, Array]]:
    """The panels of the paper's Figures 8 and 9: the user's input is not part of the assistance."""
    fields = (
        ("input", "direct_twist", "input", "user"),
        ("assistance", "assistance_twist", "assistance", "assist"),
        ("known", "known_goal_assistance_twist", "had the goal been known", "known"),
    )
    return [
        (Curve(f"{key}.{index}", name, role), replay.log.steps[field][:, index])
        for key, field, name, role in fields
    ]


def distances_to_goals(replay: Replay) -> Array:
    """From the hand to the grasp it would take at each goal [m], (n_steps, n_goals)."""
    steps, targets = replay.log.steps, replay.targets
    rows = np.clip(steps["best_targets"], 0, len(targets.positions) - 1)
    poses = steps["object_poses"].reshape(len(rows), -1, 7)
    distances = np.empty(rows.shape)
    for goal in range(rows.shape[1]):
        own = rows[:, goal]
        pose = poses[np.arange(len(own)), targets.owner[own]]
        place = pose[:, :3] + rotated(pose[:, 3:], targets.positions[own])
        distances[:, goal] = np.linalg.norm(place - steps["hand_position_m"], axis=1)
    return distances


def rotated(quaternions: Array, vectors: Array) -> Array:
    """Each vector turned by its unit quaternion w x y z: v + 2 q × (q × v + w v), (n, 3)."""
    w, xyz = quaternions[:, :1], quaternions[:, 1:]
    return vectors + 2.0 * np.cross(xyz, np.cross(xyz, vectors) + w * vectors)
