"""Send a node's property only where it differs from what was sent before."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import viser

POSITION_STEP_M = 2.0**-13
"""Positions are sent in steps of 0.12 mm: a tenth of a pixel, above the jitter of a position servo
at rest, and exact in binary, so that the wire's compression finds the zeros."""
ROTATION_STEP = 2.0**-13
"""Quaternions likewise: 2.4e-4 rad, 0.2 mm at arm's length."""
POINT_STEP_M = 2.0**-11
"""Points of arrows likewise: 0.5 mm."""
LEAST_MOVE_M = 0.002
"""An arrow whose tip has moved less than this is left as it is [m]: its length is no gauge."""


def rounded(values: Sequence[float] | np.ndarray, step: float) -> tuple[float, ...]:
    """Values to the nearest multiple of a step, as plain floats; never −0, which reads as new."""
    plain = values.tolist() if isinstance(values, np.ndarray) else values
    per_unit = 1.0 / step
    return tuple([round(value * per_unit) * step for value in plain])


class Outbox:
    """What every node was last told, and how much was said.

    viser compares too, but with a relative tolerance, after a costly cast, and not for arrays that
    change size; comparing here keeps a tick at rest free of messages and nearly free of work.
    """

    def __init__(self) -> None:
        self._sent: dict[tuple[str, str], Any] = {}
        self.count = 0
        """Messages sent since the start."""

    def place(
        self,
        handle: viser.SceneNodeHandle,
        position: Sequence[float] | np.ndarray,
        quaternion: Sequence[float] | np.ndarray | None = None,
    ) -> None:
        """Move a node to a pose in its parent's frame, quaternion w x y z."""
        self.put(handle, "position", rounded(position, POSITION_STEP_M))
        if quaternion is not None:
            self.put(handle, "wxyz", rounded(quaternion, ROTATION_STEP))

    def put(self, handle: viser.SceneNodeHandle, name: str, value: Any) -> None:
        """Assign a property whose value compares by ==."""
        key = (handle.name, name)
        if self._sent.get(key, _NOTHING) != value:
            self._sent[key] = value
            setattr(handle, name, value)
            self.count += 1

    def points(self, handle: viser.ArrowsHandle, points: np.ndarray) -> bool:
        """Assign an array of points [m] where one has moved by 2 mm; whether it had."""
        key = (handle.name, "points")
        before = self._sent.get(key)
        if before is not None and float(np.abs(points - before).max()) < LEAST_MOVE_M:
            return False
        value = (np.round(points / POINT_STEP_M) * POINT_STEP_M).astype(np.float32)
        self._sent[key] = value
        handle.points = value
        self.count += 1
        return True

    def forget(self, name: str) -> None:
        """Drop what is known of a node and its children: it is about to be made anew."""
        prefix = name + "/"
        for key in [k for k in self._sent if k[0] == name or k[0].startswith(prefix)]:
            del self._sent[key]


_NOTHING = object()
