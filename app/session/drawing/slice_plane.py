"""Where the value slice lies: the grid that is computed and the node that shows it."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from app.session.drawing.layers import SlicePlane

CELL_M = 0.0075  # [m] side of a cell
DRAFT_CELL_M = 0.02  # [m] the same while the picture keeps changing
LIFT_M = 0.004  # [m] above the table's top
HEIGHT_M = 0.66  # [m] of the vertical plane

UPRIGHT = (float(np.sqrt(0.5)), float(np.sqrt(0.5)), 0.0, 0.0)
"""Turns a picture's x and y into the world's x and z (a quarter turn about x)."""
LEVEL = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Bounds:
    """The table's top in the world frame [m]."""

    x: tuple[float, float] = (-0.15, 1.05)
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
        cell_m: Side of a cell [m].
    """

    origin: npt.NDArray[np.float64]
    axis_u: npt.NDArray[np.float64]
    axis_v: npt.NDArray[np.float64]
    shape: tuple[int, int]
    position: tuple[float, float, float]
    wxyz: tuple[float, float, float, float]
    cell_m: float = CELL_M

    @property
    def width(self) -> float:
        """Of the picture, along its columns [m]."""
        return self.shape[1] * self.cell_m

    @property
    def height(self) -> float:
        """Of the picture, along its rows [m]."""
        return self.shape[0] * self.cell_m


def slice_grid(
    plane: SlicePlane,
    hand: npt.NDArray[np.float64],
    bounds: Bounds | None = None,
    cell_m: float = CELL_M,
) -> SliceGrid:
    """The grid of a plane for a position of the hand (3,) [m].

    It covers the table in front of the robot's base, x ≥ 0; the vertical plane stands on it.
    Positions follow the hand in steps of one fine cell, so that a trembling hand does not redraw
    it.
    """
    table = bounds or Bounds()
    x_low, x_high = max(0.0, table.x[0]), table.x[1]
    columns = round((x_high - x_low) / cell_m)
    stepped = np.round(hand / CELL_M) * CELL_M
    centre_x = x_low + 0.5 * columns * cell_m
    axis_v = np.array([(columns - 1) * cell_m, 0.0, 0.0])
    if plane == "vertical":
        rows = round(HEIGHT_M / cell_m)
        y = float(stepped[1])
        origin = np.array([x_low + 0.5 * cell_m, y, 0.5 * cell_m])
        axis_u = np.array([0.0, 0.0, (rows - 1) * cell_m])
        centre = (centre_x, y, 0.5 * rows * cell_m)
        return SliceGrid(origin, axis_u, axis_v, (rows, columns), centre, UPRIGHT, cell_m)
    rows = round((table.y[1] - table.y[0]) / cell_m)
    z = max(float(stepped[2]), LIFT_M) if plane == "hand" else 0.0
    origin = np.array([x_low + 0.5 * cell_m, table.y[0] + 0.5 * cell_m, z])
    axis_u = np.array([0.0, (rows - 1) * cell_m, 0.0])
    centre = (centre_x, 0.5 * (table.y[0] + table.y[1]), max(z, LIFT_M))
    return SliceGrid(origin, axis_u, axis_v, (rows, columns), centre, LEVEL, cell_m)
