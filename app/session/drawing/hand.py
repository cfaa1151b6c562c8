"""At the hand: what the user asks for, what assistance adds, and how high the hand is."""

from collections.abc import Sequence

import numpy as np
import viser

from app.session.drawing.outbox import Outbox
from app.session.drawing.palette import Theme, rgb

SHAFT_M, HEAD_M, HEAD_LENGTH_M = 0.0065, 0.0165, 0.038
BALL_M = 0.0085
ARROW_BASE_M = 0.035  # [m] length at the slowest speed shown: the head stays whole
ARROW_SCALE_S = 0.5  # [s] further length per speed: full stick, 0.2 m/s, is 135 mm
ARROW_LONGEST_M = 0.26
SLOWEST_M_S = 0.003  # below this no arrow is drawn
RING_M = 0.02
LIFT_M = 0.006  # [m] of the ring above the table, clear of the value slice
HEIGHT_STEP_M = 2.0**-9
ARROW_WAIT = 2  # updates


def arrow_tip(velocity: np.ndarray) -> np.ndarray | None:
    """Where the arrow of a velocity (3,) [m/s] ends, from its start [m], or None if it is at rest.

    Length grows with speed from a base that keeps the head whole, up to a limit.
    """
    speed = float(np.linalg.norm(velocity))
    if speed < SLOWEST_M_S:
        return None
    return velocity / speed * min(ARROW_BASE_M + ARROW_SCALE_S * speed, ARROW_LONGEST_M)


def circle(radius: float, segments: int = 48) -> np.ndarray:
    """Line segments of a circle in the plane z = 0 [m], shape (segments, 2, 3)."""
    angle = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle], axis=1)
    return np.stack([points[:-1], points[1:]], axis=1)


class HandNodes:
    """Arrows `/hindsight/arrow/user` and `…/assist`, and the drop line `/hindsight/plumb`.

    The arrows hang on a frame that follows the hand, so their points change with the command only,
    and points are the longest messages of a tick: an arrow whose points were sent in the update
    before waits for two, so that 60 updates a second move each arrow 20 times.
    """

    def __init__(self, server: viser.ViserServer, theme: Theme, outbox: Outbox):
        self._outbox = outbox
        scene = server.scene
        self._at_hand = scene.add_frame("/hindsight/arrow", show_axes=False)
        self._ball = scene.add_icosphere(
            "/hindsight/arrow/ball",
            radius=BALL_M,
            subdivisions=3,
            color=(255, 255, 255),
            cast_shadow=False,
        )
        self._arrows = {
            name: scene.add_arrows(
                f"/hindsight/arrow/{name}",
                np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]], dtype=np.float32),
                rgb(colour),
                shaft_radius=SHAFT_M,
                head_radius=HEAD_M,
                head_length=HEAD_LENGTH_M,
                visible=False,
            )
            for name, colour in (("user", theme.user), ("assist", theme.assist))
        }
        self._waits = dict.fromkeys(self._arrows, 0)
        self._plumb = scene.add_frame("/hindsight/plumb", show_axes=False)
        self._line = scene.add_line_segments(
            "/hindsight/plumb/line",
            np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]], dtype=np.float32),
            rgb(theme.line),
            thickness=1.6,
            thickness_units="screen",
        )
        self._ring = scene.add_line_segments(
            "/hindsight/plumb/ring",
            circle(RING_M).astype(np.float32),
            rgb(theme.line),
            thickness=2.0,
            thickness_units="screen",
            position=(0.0, 0.0, LIFT_M),
        )

    def set_theme(self, theme: Theme) -> None:
        """Put arrows and drop line into a theme's colours."""
        colours = ((self._arrows["user"], theme.user), (self._arrows["assist"], theme.assist))
        for handle, colour in (*colours, (self._line, theme.line), (self._ring, theme.line)):
            handle.colors = np.array(rgb(colour), dtype=np.uint8)

    def update(
        self,
        position: Sequence[float],
        direct: Sequence[float] | None,
        assistance: Sequence[float] | None,
    ) -> None:
        """Follow the hand.

        Args:
            position: The hand in the world [m], shape (3,).
            direct: D(u), a twist (6,), or None to hide the arrow.
            assistance: What the method adds, a twist (6,), or None to hide the arrow.
        """
        hand = np.asarray(position, dtype=np.float64)
        self._outbox.place(self._at_hand, hand)
        for name, twist in (("user", direct), ("assist", assistance)):
            tip = None if twist is None else arrow_tip(np.asarray(twist[:3], dtype=np.float64))
            handle = self._arrows[name]
            if tip is None or self._waits[name] > 0:
                self._waits[name] = max(0, self._waits[name] - 1)
            elif self._outbox.points(handle, np.stack([np.zeros(3), tip])[None]):
                self._waits[name] = ARROW_WAIT
            self._outbox.put(handle, "visible", tip is not None)
        self._outbox.place(self._plumb, [hand[0], hand[1], 0.0])
        height = float(np.round(max(hand[2], 0.0) / HEIGHT_STEP_M) * HEIGHT_STEP_M)
        self._outbox.put(self._line, "scale", (1.0, 1.0, max(height, HEIGHT_STEP_M)))
        self._outbox.put(self._plumb, "visible", bool(hand[2] > 0.0))
