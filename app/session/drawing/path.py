"""The hand's path in this trial, as a chain of short splines."""

from collections.abc import Sequence

import numpy as np
import viser

from app.session.drawing.palette import Theme, rgb

SPACING_M = 0.008  # [m] between points that are kept
CHUNK = 24  # intervals to a spline
EVERY_S = 0.1  # [s] of the trial's time between two extensions
MOST_POINTS = 1440  # 11.5 m of path; then every second point goes
THICKNESS_PX = 1.8


class PathNodes:
    """Splines `/hindsight/path/<n>`; only the newest, a few hundred bytes, is ever sent again."""

    def __init__(self, server: viser.ViserServer, theme: Theme):
        self._scene = server.scene
        self._colour = rgb(theme.line)
        self._points: list[tuple[float, float, float]] = []
        self._spacing = SPACING_M
        self._splines: list[viser.SplineCatmullRomHandle] = []
        self._drawn, self._drawn_at = 0, -np.inf
        self._visible = False

    def set_theme(self, theme: Theme) -> None:
        """Put the path into a theme's colour."""
        self._colour = rgb(theme.line)
        for spline in self._splines:
            spline.color = self._colour

    def set_visible(self, visible: bool) -> None:
        """Show or hide the path; its points are kept while hidden."""
        if visible != self._visible:
            self._visible = visible
            self._remove_splines()
            self._draw()

    def clear(self) -> None:
        """Forget the path: a new trial."""
        self._points, self._spacing = [], SPACING_M
        self._drawn_at = -np.inf
        self._remove_splines()

    def update(self, position: Sequence[float], time_s: float) -> bool:
        """Add where the hand is, in the world [m], at a time of the trial [s].

        Returns:
            Whether anything was sent.
        """
        point = (float(position[0]), float(position[1]), float(position[2]))
        if self._points and np.linalg.norm(np.subtract(point, self._points[-1])) < self._spacing:
            return False
        self._points.append(point)
        if len(self._points) > MOST_POINTS:
            self._points = self._points[::2]
            self._spacing *= 2.0
            self._remove_splines()
        if time_s - self._drawn_at < EVERY_S:
            return False
        self._drawn_at = time_s
        return self._draw()

    def _draw(self) -> bool:
        """Send the splines that have grown since the last time."""
        if not self._visible or len(self._points) < 2 or self._drawn == len(self._points):
            return False
        first = max(self._drawn - 1, 0) // CHUNK
        for index in range(first, (len(self._points) - 2) // CHUNK + 1):
            part = self._points[index * CHUNK : (index + 1) * CHUNK + 1]
            points = np.asarray(part, dtype=np.float32)
            if index < len(self._splines):
                self._splines[index].points = points
            else:
                self._splines.append(
                    self._scene.add_spline_catmull_rom(
                        f"/hindsight/path/{index}",
                        points,
                        thickness=THICKNESS_PX,
                        thickness_units="screen",
                        color=self._colour,
                    )
                )
        self._drawn = len(self._points)
        return True

    def _remove_splines(self) -> None:
        for spline in self._splines:
            spline.remove()
        self._splines, self._drawn = [], 0
