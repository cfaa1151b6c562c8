"""The colours of the 3-D view, one table per theme.

Colour is data and the chrome is grey: yellow is the person, pink the robot's help, each object has
one hue. The numbers were chosen against viser's tone mapping, so arrows are darker here than the
same token on the page.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from app.errors import AppError

ThemeName = Literal["dark", "light"]
Rgb = tuple[int, int, int]


class ThemeError(AppError):
    """A theme that does not exist."""


def rgb(code: str) -> Rgb:
    """Read "#RRGGBB" as three numbers from 0 to 255."""
    if len(code) != 7 or code[0] != "#":
        raise ThemeError(f"{code!r} is not a colour: write it as #RRGGBB, for example #56B4E9")
    try:
        red, green, blue = bytes.fromhex(code[1:])
    except ValueError as error:
        raise ThemeError(
            f"{code!r} is not a colour: write it as #RRGGBB, for example #56B4E9"
        ) from error
    return red, green, blue


def linear(code: str) -> npt.NDArray[np.float64]:
    """Read "#RRGGBB" as linear light in [0, 1], which glTF's baseColorFactor wants, shape (3,)."""
    srgb = np.asarray(rgb(code)) / 255.0
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


@dataclass(frozen=True, slots=True)
class Theme:
    """Everything that differs between dark and light.

    Attributes:
        environment: Intensity of the environment map.
        key, fill: Intensities of the two directional lights.
        hemisphere: Sky colour, ground colour and intensity of the hemisphere light.
        floor: Colours of the floor's plane, cells and sections.
        floor_shadow: Opacity of shadows on the floor.
        shell, joint, ring, pad, table, legs: Surfaces, see `materials`.
        user, assist: Arrows.
        line: Plumb line, its ring, and the hand's path.
        markers: Colours of ghosts and target rings by the hue of their object's surface.
        slice_alpha: Opacity of the value slice far from the goal and at it.
        ramp_reversed: Whether the value ramp runs from pale (far) to dark (near).
    """

    name: ThemeName
    environment: float
    key: float
    fill: float
    hemisphere: tuple[str, str, float]
    floor: tuple[str, str, str]
    floor_shadow: float
    shell: str
    joint: str
    ring: str
    pad: str
    table: str
    table_roughness: float
    legs: str
    user: str
    assist: str
    line: str
    markers: dict[str, str]
    slice_alpha: tuple[float, float]
    ramp_reversed: bool


DARK = Theme(
    name="dark",
    environment=0.36,
    key=2.1,
    fill=0.9,
    hemisphere=("#C9D8EA", "#2A2622", 0.28),
    floor=("#1A2027", "#2A333D", "#3A4551"),
    floor_shadow=0.55,
    shell="#DFE3E6",
    joint="#23282E",
    ring="#8A949E",
    pad="#15181B",
    table="#2A3138",
    table_roughness=0.72,
    legs="#20262C",
    user="#D9B800",
    assist="#B8478C",
    line="#EEF1F4",
    markers={
        "green": "#239D6A",
        "vermilion": "#DB640E",
        "sky": "#69C1FC",
        "orange": "#E69F00",
        "blue": "#6D93FF",
    },
    slice_alpha=(0.22, 0.68),
    ramp_reversed=False,
)

LIGHT = Theme(
    name="light",
    environment=0.5,
    key=2.0,
    fill=0.45,
    hemisphere=("#FFFFFF", "#D8D4CC", 0.55),
    floor=("#DFE3E7", "#CBD1D7", "#B9C1C9"),
    floor_shadow=0.22,
    shell="#E9ECEE",
    joint="#3A4149",
    ring="#9AA4AE",
    pad="#15181B",
    table="#D3D6D9",
    table_roughness=0.8,
    legs="#9AA1A8",
    user="#C79A00",
    assist="#A02472",
    line="#14191F",
    markers={
        "green": "#00694B",
        "vermilion": "#D45C00",
        "sky": "#2089CC",
        "orange": "#A36F00",
        "blue": "#3D5FD0",
    },
    slice_alpha=(0.16, 0.78),
    ramp_reversed=True,
)

_THEMES: dict[str, Theme] = {"dark": DARK, "light": LIGHT}

SURFACE_HUES = {
    "green": "#009E73",
    "vermilion": "#D55E00",
    "sky": "#56B4E9",
    "orange": "#E69F00",
    "blue": "#6D93FF",
}
"""Hues of the objects' own surfaces as scenes give them: Okabe–Ito and a fifth, in both themes."""

RAMP = ("#281155", "#33438D", "#1080AE", "#4DB7B6", "#A4E5CB")
"""Value ramp in even steps of OKLab lightness: indigo, teal, mint."""


def theme(name: str) -> Theme:
    """Look a theme up.

    Raises:
        ThemeError: If there is no such theme.
    """
    if name not in _THEMES:
        raise ThemeError(f"theme {name!r} does not exist; valid are: {', '.join(_THEMES)}")
    return _THEMES[name]


def marker(table: Theme, surface: str) -> Rgb:
    """Colour of what marks an object whose surface has this colour.

    A surface that is none of the known hues marks itself.
    """
    for name, code in SURFACE_HUES.items():
        if max(abs(a - b) for a, b in zip(rgb(code), rgb(surface), strict=True)) <= 1:
            return rgb(table.markers[name])
    return rgb(surface)
