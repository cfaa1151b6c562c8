"""The value slice in the scene: computed, coloured and sent beside the loop, never in it."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser

from app.core.settings import AssistanceSettings
from app.core.types import Array, Goals
from app.session.drawing.layers import BELIEF, SOFT_MIN, SlicePlane
from app.session.drawing.palette import Theme
from app.session.drawing.slice_picture import slice_picture
from app.session.drawing.slice_plane import CELL_M, Bounds, SliceGrid, slice_grid

NODE = "/hindsight/slice"
PERIOD_S = 0.1  # at most ten pictures a second with iso-lines, twenty without
SAME_POSITION_M, SAME_ROTATION, SAME_BELIEF = 1e-3, 5e-3, 4e-3
"""Changes below these leave the picture as it is: they would move a shade by less than a step."""

log = logging.getLogger(__name__)

ValueSlice = Callable[..., Array]
"""`app.core.value_slice`, or what stands in for it in a test."""


@dataclass(frozen=True, slots=True)
class SliceRequest:
    """What the slice depends on.

    Attributes:
        settings: The assistance whose V is drawn.
        goals: Goals with their targets in the world.
        belief: Probability of each goal, shape (n_goals,).
        hand_position: In the world [m], shape (3,).
        hand_quaternion: w x y z; V is drawn for a hand of this orientation.
        of: "belief", "soft-min" or a goal's name.
        plane: Where the slice lies.
    """

    settings: AssistanceSettings
    goals: Goals
    belief: tuple[float, ...]
    hand_position: Array
    hand_quaternion: Array
    of: str
    plane: SlicePlane


class SliceLayer:
    """Node `/hindsight/slice` and the thread that keeps it up to date."""

    def __init__(
        self, server: viser.ViserServer, theme: Theme, compute: ValueSlice, bounds: Bounds
    ):
        self._server, self._theme, self._compute, self._bounds = server, theme, compute, bounds
        self._image: viser.ImageHandle | None = None
        self._shown: tuple[SliceRequest, Theme] | None = None
        self._visible = False
        self._newest: SliceRequest | None = None
        self._lock = threading.Lock()
        self._wake, self._end = threading.Event(), threading.Event()
        self._thread: threading.Thread | None = None
        self.value_range: tuple[float, float] | None = None
        """Ends of the legend [nat], or None while no slice is shown."""
        self.pictures = 0
        """Pictures sent since the start."""

    def request(self, request: SliceRequest) -> None:
        """Ask for a slice; returns at once, and only the newest request is ever drawn."""
        self._newest = request
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="value-slice", daemon=True)
            self._thread.start()
        self._wake.set()

    def set_theme(self, theme: Theme) -> None:
        """Use a theme's ramp from the next picture on, which is asked for at once."""
        self._theme = theme
        if self._thread is not None:
            self._wake.set()

    def set_visible(self, visible: bool) -> None:
        """Show or hide the slice; nothing is computed while it is hidden."""
        with self._lock:
            self._visible = visible
            if not visible:
                self.value_range = None
            if self._image is not None:
                self._image.visible = visible
            self._shown = None
        if visible and self._thread is not None:
            self._wake.set()

    def close(self) -> None:
        """End the thread; safe to call twice."""
        self._end.set()
        self._wake.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)

    def draw(self, request: SliceRequest) -> bool:
        """Draw a slice now, in this thread, if it would look different from the one shown.

        Returns:
            Whether a picture was sent.
        """
        with self._lock:
            theme = self._theme
            if not self._visible or self._same(request, theme):
                return False
        grid = slice_grid(request.plane, request.hand_position, self._bounds)
        values = self._compute(
            request.settings,
            request.goals,
            np.asarray(request.belief, dtype=np.float64),
            grid.origin,
            grid.axis_u,
            grid.axis_v,
            grid.shape,
            request.hand_quaternion,
            of="expected" if request.of in (BELIEF, SOFT_MIN) else request.of,
            kind="soft-min" if request.of == SOFT_MIN else "min",
        )
        picture, span = slice_picture(np.asarray(values), theme, CELL_M)
        with self._lock:
            if not self._visible:
                return False
            self._show(grid, picture)
            self._shown, self.value_range = (request, theme), span
            self.pictures += 1
        return True

    def _run(self) -> None:
        """Draw the newest request whenever there is one, at most ten times a second."""
        while True:
            self._wake.wait()
            if self._end.is_set():
                return
            self._wake.clear()
            request, started = self._newest, time.monotonic()
            if request is None or not self._visible:
                continue
            try:
                self.draw(request)
            except Exception:  # the view must outlive a slice that cannot be computed
                log.exception("the value slice could not be drawn")
                self.value_range = None
            self._end.wait(max(0.0, PERIOD_S - (time.monotonic() - started)))

    def _same(self, request: SliceRequest, theme: Theme) -> bool:
        """Whether the picture shown is the one asked for."""
        if self._shown is None or self._shown[1] is not theme:
            return False
        old = self._shown[0]
        if (old.of, old.plane, old.settings) != (request.of, request.plane, request.settings):
            return False
        if old.goals.names != request.goals.names or len(old.belief) != len(request.belief):
            return False
        if request.of in (BELIEF, SOFT_MIN) and not np.allclose(
            old.belief, request.belief, rtol=0.0, atol=SAME_BELIEF
        ):
            return False
        old_grid = slice_grid(old.plane, old.hand_position, self._bounds)
        new_grid = slice_grid(request.plane, request.hand_position, self._bounds)
        return (
            np.array_equal(old_grid.origin, new_grid.origin)
            and _close(old.hand_quaternion, request.hand_quaternion, SAME_ROTATION)
            and _close(old.goals.positions, request.goals.positions, SAME_POSITION_M)
            and _close(old.goals.quaternions, request.goals.quaternions, SAME_ROTATION)
        )

    def _show(self, grid: SliceGrid, picture: np.ndarray) -> None:
        """Put a picture into the scene, in place where its size is the same."""
        image = self._image
        if image is None or (image.render_width, image.render_height) != (grid.width, grid.height):
            self._image = self._server.scene.add_image(
                NODE,
                picture,
                grid.width,
                grid.height,
                format="png",
                cast_shadow=False,
                receive_shadow=False,
                position=grid.position,
                wxyz=grid.wxyz,
            )
            return
        image.image = picture
        image.position, image.wxyz = grid.position, grid.wxyz


def _close(old: Array, new: Array, tolerance: float) -> bool:
    return old is new or (
        old.shape == new.shape and bool(np.allclose(old, new, rtol=0.0, atol=tolerance))
    )
