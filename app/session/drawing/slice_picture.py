"""Numbers to pixels: the value function on a grid as a translucent picture."""

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from app.session.drawing.palette import RAMP, Theme, rgb
from app.session.drawing.palette import theme as theme_by_name

ISO_STEP_NAT = 0.125
MOST_ISO_LINES = 16
"""Where the values span more, the step doubles until no more lines than this are left."""
FADE_M = 0.04  # [m] from full to nothing at the edge
ALPHA_POWER = 1.3
ISO_ALPHA = (0.16, 0.22)  # of a line: at the far end, and what is added towards the goal
ISO_WIDTH_PX = 1.0
COVERS = 8  # steps from no line to all line
RANGE_STEP_NAT = 0.05  # the range is rounded outward to this, so that the legend holds still
SHADES = 64
"""Steps of the ramp. Fewer distinct pixels make the PNG half as long; a step is below what the eye
can tell at these opacities."""
DRAFT_SHADES = 24
"""The same while the picture keeps changing."""


def value_range(values: npt.NDArray[np.float64]) -> tuple[float, float]:
    """Least and greatest value on the grid, rounded outward [nat]."""
    low = float(np.floor(values.min() / RANGE_STEP_NAT) * RANGE_STEP_NAT)
    high = float(np.ceil(values.max() / RANGE_STEP_NAT) * RANGE_STEP_NAT)
    return low, max(high, low + RANGE_STEP_NAT)


def iso_step(low: float, high: float) -> float:
    """Distance between two iso-lines [nat]: 0.125, doubled until there are few enough."""
    step = ISO_STEP_NAT
    while (high - low) / step > MOST_ISO_LINES:
        step *= 2.0
    return step


def ramp_colours(theme: Theme, shades: int = SHADES) -> npt.NDArray[np.uint8]:
    """The ramp from far to near in a theme, shape (shades, 3)."""
    stops = np.array([rgb(code) for code in RAMP], dtype=np.float64)
    if theme.ramp_reversed:
        stops = stops[::-1]
    at = np.linspace(0.0, len(stops) - 1, shades)
    channels = [np.interp(at, np.arange(len(stops)), stops[:, c]) for c in range(3)]
    return np.round(np.stack(channels, axis=1)).astype(np.uint8)


@lru_cache(maxsize=8)
def edge_fade(shape: tuple[int, int], cell_m: float) -> npt.NDArray[np.float64]:
    """Factor on opacity that falls to nothing within 40 mm of the edge, smooth at both ends."""
    rows, columns = (
        np.minimum(np.arange(n) + 0.5, n - np.arange(n) - 0.5) * cell_m / FADE_M for n in shape
    )
    depth = np.clip(np.minimum(rows[:, None], columns[None, :]), 0.0, 1.0)
    return depth * depth * (3.0 - 2.0 * depth)


def slice_picture(
    values: npt.NDArray[np.float64],
    theme: Theme,
    cell_m: float,
    iso_lines: bool = True,
    shades: int = SHADES,
) -> tuple[npt.NDArray[np.uint8], tuple[float, float]]:
    """Colour a grid of cost-to-go.

    With t = 0 at the highest value and 1 at the lowest (at the goal), colour is the ramp at t and
    opacity rises with t^1.3; white lines one pixel wide join points of equal value.

    Args:
        values: Cost-to-go V [nat], shape (rows, columns).
        theme: Ramp direction and opacities.
        cell_m: Side of a cell [m].
        iso_lines: Whether lines are drawn; without them the PNG is a third as long.
        shades: Steps of the ramp.

    Returns:
        RGBA, shape (rows, columns, 4), and the range (low, high) of the legend [nat].
    """
    low, high = value_range(values)
    near = np.clip((high - values) / (high - low), 0.0, 1.0)
    shade = np.round(near * (shades - 1)).astype(np.intp)
    cover = _iso_cover(values, iso_step(low, high)) if iso_lines else np.zeros_like(shade)
    picture = _pixels(theme.name, shades)[shade, cover]
    picture[..., 3] = np.round(picture[..., 3] * edge_fade(values.shape, cell_m))
    return picture, (low, high)


def _iso_cover(values: npt.NDArray[np.float64], step: float) -> npt.NDArray[np.intp]:
    """How much of each pixel a line covers, in eighths, shape of values.

    The distance to the nearest line in pixels is the distance in value over the slope, so lines
    are equally wide where the function is steep and where it is flat.
    """
    phase = values / step
    away = np.abs(phase - np.round(phase))
    down, across = np.gradient(phase)
    slope = np.hypot(down, across)  # [steps] per pixel
    covered = np.clip(0.5 * ISO_WIDTH_PX + 0.5 - away / np.maximum(slope, 1e-9), 0.0, 1.0)
    return np.round(covered * COVERS).astype(np.intp)


@lru_cache(maxsize=4)
def _pixels(name: str, shades: int) -> npt.NDArray[np.uint8]:
    """Every pixel a slice in a theme can hold, by shade and cover, shape (shades, COVERS + 1, 4).

    The line is white over the ramp, and both lie over what is behind them.
    """
    look = theme_by_name(name)
    level = np.linspace(0.0, 1.0, shades)[:, None]
    least, most = look.slice_alpha
    ramp = least + (most - least) * level**ALPHA_POWER
    line = np.linspace(0.0, 1.0, COVERS + 1) * (ISO_ALPHA[0] + ISO_ALPHA[1] * level)
    below = ramp * (1.0 - line)
    total = line + below
    pixels = np.empty((shades, COVERS + 1, 4))
    colours = ramp_colours(look, shades)[:, None, :]
    pixels[..., :3] = (255.0 * line[..., None] + colours * below[..., None]) / total[..., None]
    pixels[..., 3] = 255.0 * total
    return np.round(pixels).astype(np.uint8)
