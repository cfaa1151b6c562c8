"""Where the value slice lies: the grid that is computed and the node that shows it."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.session.drawing.layers import SlicePlane

CELL_M = 0.0075  # [m] side of a cell
LIFT_M = 0.004  # [m] above the table's top
HEIGHT_CELLS = 88  # of the vertical plane: 0.66 m

UPRIGHT = (float(np.sqrt(0.5)), float(np.sqrt(0.5)), 0.0, 0.0)
"""Turns a picture's x and y into the world's x and z (a quarter turn about x)."""
LEVEL = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Bounds:
    """The table's top in the world frame [m]."""

    x: tuple[float, float] = (-0.15, 0.9)
    y: tuple[float, float] = (-0.6, 0.6)


@dataclass(frozen=True, slots=True)
class SliceGrid:
    """A grid of points in the world and the picture that lies on it.

    Point (i, j) is origin + i/(rows − 1)·axis_u + j/(columns − 1)·axis_v, as in
    `core.value_slice`; it is the centre of the picture's cell in row i and column j.

    Attributes:
        origin: Centre of cell (0, 0) [m], shape (3,).
        axis_u, axis_v: From the first row to the last and the first column to the last [m], (3,).
        shape: Rows and columns.
        position: Centre of the picture in the world [m].
        wxyz: Its orientation.
    """

    origin: npt.NDArray[np.float64]
    axis_u: npt.NDArray[np.float64]
    axis_v: npt.NDArray[np.float64]
    shape: tuple[int, int]
    position: tuple[float, float, float]
    wxyz: tuple[float, float, float, float]

    @property
    def width(self) -> float:
        """Of the picture, along its columns [m]."""
        return self.shape[1] * CELL_M

    @property
    def height(self) -> float:
        """Of the picture, along its rows [m]."""
        return self.shape[0] * CELL_M


def slice_grid(
    plane: SlicePlane, hand: npt.NDArray[np.float64], bounds: Bounds | None = None
) -> SliceGrid:
    """The grid of a plane for a position of the hand (3,) [m].

    It covers the table in front of the robot's base, x ≥ 0; the vertical plane stands on it.
    Positions follow the hand in steps of one cell, so that a trembling hand does not redraw it.
    """
    table = bounds or Bounds()
    x_low, x_high = max(0.0, table.x[0]), table.x[1]
    columns = round((x_high - x_low) / CELL_M)
    stepped = np.round(hand / CELL_M) * CELL_M
    centre_x = x_low + 0.5 * columns * CELL_M
    axis_v = np.array([(columns - 1) * CELL_M, 0.0, 0.0])
    if plane == "vertical":
        shape = (HEIGHT_CELLS, columns)
        y = float(stepped[1])
        origin = np.array([x_low + 0.5 * CELL_M, y, 0.5 * CELL_M])
        axis_u = np.array([0.0, 0.0, (HEIGHT_CELLS - 1) * CELL_M])
        return SliceGrid(
            origin, axis_u, axis_v, shape, (centre_x, y, 0.5 * HEIGHT_CELLS * CELL_M), UPRIGHT
        )
    rows = round((table.y[1] - table.y[0]) / CELL_M)
    z = max(float(stepped[2]), LIFT_M) if plane == "hand" else 0.0
    origin = np.array([x_low + 0.5 * CELL_M, table.y[0] + 0.5 * CELL_M, z])
    axis_u = np.array([0.0, (rows - 1) * CELL_M, 0.0])
    centre = (centre_x, 0.5 * (table.y[0] + table.y[1]), max(z, LIFT_M))
    return SliceGrid(origin, axis_u, axis_v, (rows, columns), centre, LEVEL)
