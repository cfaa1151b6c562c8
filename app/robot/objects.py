"""Kinds of objects a scene can hold, all from primitives, in metres and kilograms.

The frame of an object is the centre of its footprint, z up: an object that stands at a place has
z = 0.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Hue = Literal["green", "vermilion", "sky", "orange", "blue"]
"""Colours that stay apart for colour-blind eyes: Okabe–Ito, and a fifth."""

HUES: dict[str, tuple[float, float, float]] = {
    "green": (0.000, 0.620, 0.451),
    "vermilion": (0.835, 0.369, 0.000),
    "sky": (0.337, 0.706, 0.914),
    "orange": (0.902, 0.624, 0.000),
    "blue": (0.427, 0.576, 1.000),
}
"""sRGB of each hue, 0 to 1."""

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,31}$")]
Mass = Annotated[float, Field(ge=0.02, le=1.0)]
Radius = Annotated[float, Field(ge=0.008, le=0.045)]
"""At most 0.045 m: the hand opens 0.10 m, and each finger needs 5 mm."""
Height = Annotated[float, Field(ge=0.04, le=0.30)]
Side = Annotated[float, Field(ge=0.015, le=0.30)]


class Strict(BaseModel):
    """Frozen, finite, and without fields nobody knows."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class ObjectBase(Strict):
    """What all kinds have in common."""

    name: Name
    colour: Hue
    mass_kg: Mass


class Canteen(ObjectBase):
    """A bottle: a cylinder, a round shoulder and a narrow neck with a cap."""

    kind: Literal["canteen"]
    radius_m: Radius = 0.035
    body_height_m: Height = 0.12
    neck_radius_m: Annotated[float, Field(ge=0.008, le=0.030)] = 0.016
    neck_height_m: Annotated[float, Field(ge=0.02, le=0.10)] = 0.052


class Glass(ObjectBase):
    """A see-through tumbler; its water is drawn, and its weight is in `mass_kg`."""

    kind: Literal["glass"]
    radius_m: Radius = 0.032
    height_m: Height = 0.11
    water_level: Annotated[float, Field(ge=0.0, le=0.95)] = 0.5


class Cylinder(ObjectBase):
    """A can: a plain upright cylinder."""

    kind: Literal["cylinder"]
    radius_m: Radius
    height_m: Height


class Block(ObjectBase):
    """A wooden block; x, y, z sides."""

    kind: Literal["block"]
    size_m: tuple[Side, Side, Height] = (0.05, 0.06, 0.10)


class Box(ObjectBase):
    """A carton: x, y, z sides; one horizontal side has to fit into the hand."""

    kind: Literal["box"]
    size_m: tuple[Side, Side, Height]


ObjectSpec = Annotated[Canteen | Glass | Cylinder | Block | Box, Field(discriminator="kind")]
AnyObject = Canteen | Glass | Cylinder | Block | Box
KINDS = ("canteen", "glass", "cylinder", "block", "box")


def object_height(item: AnyObject) -> float:
    """Height over the table [m] of the standing object."""
    if isinstance(item, Canteen):
        return item.body_height_m + item.neck_height_m
    if isinstance(item, Block | Box):
        return item.size_m[2]
    return item.height_m


def footprint_radius(item: AnyObject) -> float:
    """Radius [m] of the smallest upright cylinder around the object."""
    if isinstance(item, Block | Box):
        return 0.5 * (item.size_m[0] ** 2 + item.size_m[1] ** 2) ** 0.5
    return item.radius_m
