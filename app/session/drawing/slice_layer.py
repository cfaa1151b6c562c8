"""The value slice in the scene: computed, coloured and sent beside the loop, never in it.

While what it shows keeps changing it is sent as drafts of 2 kB, coarse and without lines; a fine
one of up to 23 kB follows once the picture holds still, so that a session stays within 30 kB a
second.
"""

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
from app.session.drawing.slice_picture import DRAFT_SHADES, SHADES, slice_picture
from app.session.drawing.slice_plane import CELL_M, DRAFT_CELL_M, Bounds, SliceGrid, slice_grid

NODE = "/hindsight/slice"
PERIOD_S = 0.1
"""How often a request is looked at [s]."""
DRAFT_PERIOD_S = 0.5
"""From one draft to the next [s]."""
REST_S = 1.0
"""How long a draft stands before the fine picture takes its place [s]."""
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
        self._is_draft = False
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

    def draw(self, request: SliceRequest, draft: bool = False) -> bool:
        """Draw a slice now, in this thread, if it would look different from the one shown.

        Args:
            request: What to show.
            draft: Whether coarse and without lines will do.

        Returns:
            Whether a picture was sent.
        """
        with self._lock:
            theme = self._theme
            better = self._is_draft and not draft
            if not self._visible or (self._same(request, theme) and not better):
                return False
        cell_m = DRAFT_CELL_M if draft else CELL_M
        grid = slice_grid(request.plane, request.hand_position, self._bounds, cell_m)
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
        shades = DRAFT_SHADES if draft else SHADES
        picture, span = slice_picture(np.asarray(values), theme, cell_m, not draft, shades)
        with self._lock:
            if not self._visible:
                return False
            self._show(grid, picture)
            self._shown, self._is_draft, self.value_range = (request, theme), draft, span
            self.pictures += 1
        return True

    def _run(self) -> None:
        """Draw the newest request whenever there is one: drafts in a row, then a fine picture."""
        drawn_s = float("-inf")
        while True:
            self._wake.wait(PERIOD_S if self._is_draft else None)
            if self._end.is_set():
                return
            self._wake.clear()
            request, started = self._newest, time.monotonic()
            if request is None or not self._visible:
                continue
            try:
                if self.draw(request, draft=self._follows(request)):
                    drawn_s = time.monotonic()
                elif self._is_draft and started - drawn_s > REST_S:
                    self.draw(request)
            except Exception:  # the view must outlive a slice that cannot be computed
                log.exception("the value slice could not be drawn")
                self.value_range = None
            period = DRAFT_PERIOD_S if drawn_s >= started else PERIOD_S
            self._end.wait(max(0.0, period - (time.monotonic() - started)))

    def _follows(self, request: SliceRequest) -> bool:
        """Whether the request shows what is shown already, a moment later: a draft will do."""
        with self._lock:
            if self._shown is None or self._shown[1] is not self._theme:
                return False
            old = self._shown[0]
        return (old.of, old.plane, old.settings) == (request.of, request.plane, request.settings)

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
        size = (grid.width, grid.height)
        if image is None or not np.allclose((image.render_width, image.render_height), size):
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
