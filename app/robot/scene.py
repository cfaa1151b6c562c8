"""What a scene is: objects, the places they may stand at, the table, the start pose."""

from collections.abc import Iterator
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from app.core.types import Array
from app.robot.arm import APERTURE, HIGH_DEGREES, HOME_DEGREES, LOW_DEGREES, N_JOINTS
from app.robot.errors import SceneError
from app.robot.objects import Block, Box, Name, ObjectSpec, Strict, footprint_radius

Layout = tuple[int, ...]
"""For each object, in the scene's order, the number of the place it stands at."""

MAX_GRASP_WIDTH = APERTURE - 0.01  # [m]: 5 mm for each finger
BASE_CLEARANCE = 0.25  # [m] of a place from the robot's axis
GAP = 0.005  # [m] between neighbours


class Place(Strict):
    """A spot on the table where an object may stand; yaw turns the object about z."""

    name: Name
    x_m: float
    y_m: float
    yaw_degrees: Annotated[float, Field(ge=-180.0, le=180.0)] = 0.0


class Table(Strict):
    """The table's top, z = 0, in the world frame; the robot's base stands on it."""

    x_min_m: Annotated[float, Field(ge=-1.0, le=-0.08)] = -0.15
    x_max_m: Annotated[float, Field(ge=0.4, le=1.5)] = 1.05
    y_min_m: Annotated[float, Field(ge=-1.5, le=-0.2)] = -0.60
    y_max_m: Annotated[float, Field(ge=0.2, le=1.5)] = 0.60


class FieldProblem(ValueError):
    """A problem that pydantic cannot see in one field alone; `where` leads to the field."""

    def __init__(self, where: tuple[str | int, ...], text: str) -> None:
        super().__init__(text)
        self.where = where


class Scene(Strict):
    """A scene file, validated. Object i stands at place layout[i], by default at place i."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$")]
    title: Annotated[str, Field(min_length=1, max_length=80)]
    time_limit_s: Annotated[float, Field(ge=5.0, le=600.0)] = 60.0
    start_degrees: Annotated[tuple[float, ...], Field(min_length=N_JOINTS, max_length=N_JOINTS)] = (
        HOME_DEGREES
    )
    table: Table = Table()
    places: Annotated[tuple[Place, ...], Field(min_length=1, max_length=12)]
    objects: Annotated[tuple[ObjectSpec, ...], Field(min_length=1, max_length=12)]

    @property
    def object_names(self) -> tuple[str, ...]:
        """The objects' names in the scene's order; these are the goals."""
        return tuple(item.name for item in self.objects)

    @property
    def start_joint_positions(self) -> Array:
        """Start pose q [rad], shape (7,)."""
        return np.radians(np.array(self.start_degrees))

    @property
    def default_layout(self) -> Layout:
        """Object i at place i."""
        return tuple(range(len(self.objects)))

    def object_index(self, name: str) -> int:
        """Position of an object in the scene's order.

        Raises:
            SceneError: If the scene has no object of this name.
        """
        if name not in self.object_names:
            raise SceneError(
                f"scene {self.name!r} has no object {name!r}; valid: {', '.join(self.object_names)}"
            )
        return self.object_names.index(name)

    def checked_layout(self, layout: Layout | None) -> Layout:
        """The layout, or the default one for None.

        Raises:
            SceneError: If it does not name one place of its own for every object.
        """
        if layout is None:
            return self.default_layout
        n_objects, n_places = len(self.objects), len(self.places)
        valid = (
            len(layout) == n_objects
            and len(set(layout)) == n_objects
            and all(0 <= place < n_places for place in layout)
        )
        if not valid:
            raise SceneError(
                f"layout {tuple(layout)!r} does not fit scene {self.name!r}; valid: {n_objects} "
                f"different places out of 0 to {n_places - 1}"
            )
        return tuple(int(place) for place in layout)

    @model_validator(mode="after")
    def _check(self) -> Self:
        for problem in _problems(self):
            raise problem
        return self


def _problems(scene: Scene) -> Iterator[FieldProblem]:
    """What is wrong between fields, each with the way to the field at fault."""
    yield from _repeated_names(scene)
    limits = zip(scene.start_degrees, LOW_DEGREES, HIGH_DEGREES, strict=True)
    for i, (angle, low, high) in enumerate(limits):
        if not low <= angle <= high:
            yield FieldProblem(
                ("start_degrees", i),
                f"{angle:g} is beyond joint {i + 1}; valid: {low:g} to {high:g}",
            )
    if len(scene.places) < len(scene.objects):
        yield FieldProblem(
            ("places",),
            f"{len(scene.places)} places for {len(scene.objects)} objects; valid: at least "
            f"{len(scene.objects)}",
        )
    for i, item in enumerate(scene.objects):
        if isinstance(item, Block | Box) and min(item.size_m[:2]) > MAX_GRASP_WIDTH:
            yield FieldProblem(
                ("objects", i, "size_m"),
                f"{list(item.size_m)} does not fit into the hand; valid: x or y at most "
                f"{MAX_GRASP_WIDTH:g}",
            )
        if item.kind == "canteen" and item.neck_radius_m > item.radius_m:
            yield FieldProblem(
                ("objects", i, "neck_radius_m"),
                f"{item.neck_radius_m:g} is wider than the body; valid: at most {item.radius_m:g}",
            )
    yield from _crowded_places(scene)


def _repeated_names(scene: Scene) -> Iterator[FieldProblem]:
    for field, items in (("places", scene.places), ("objects", scene.objects)):
        seen: set[str] = set()
        for i, item in enumerate(items):
            if item.name in seen:
                yield FieldProblem(
                    (field, i, "name"), f"{item.name!r} is taken; valid: a name of its own"
                )
            seen.add(item.name)


def _crowded_places(scene: Scene) -> Iterator[FieldProblem]:
    """Any object may stand at any place, so every place must have room for the widest ones."""
    widths = sorted((footprint_radius(item) for item in scene.objects), reverse=True)
    table, edge = scene.table, widths[0]
    apart = sum(widths[:2]) + GAP
    for i, place in enumerate(scene.places):
        for field, value, low, high in (
            ("x_m", place.x_m, table.x_min_m + edge, table.x_max_m - edge),
            ("y_m", place.y_m, table.y_min_m + edge, table.y_max_m - edge),
        ):
            if not low <= value <= high:
                yield FieldProblem(
                    ("places", i, field),
                    f"{value:g} is off the table for the widest object; valid: {low:.3f} to "
                    f"{high:.3f}",
                )
        if np.hypot(place.x_m, place.y_m) < BASE_CLEARANCE:
            yield FieldProblem(
                ("places", i, "x_m"),
                f"({place.x_m:g}, {place.y_m:g}) is at the robot's base; valid: at least "
                f"{BASE_CLEARANCE:g} from (0, 0)",
            )
        for other in scene.places[:i]:
            distance = np.hypot(place.x_m - other.x_m, place.y_m - other.y_m)
            if len(widths) > 1 and distance < apart:
                yield FieldProblem(
                    ("places", i, "x_m"),
                    f"{place.name!r} is {distance:.3f} from {other.name!r}; valid: at least "
                    f"{apart:.3f} apart",
                )
