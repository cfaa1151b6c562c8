"""Send a node's property only where it differs from what was sent before."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import viser

POSITION_STEP_M = 2.0**-16
"""Positions are sent in steps of 15 µm: below a pixel at any distance, above the jitter of a
position servo at rest, and exact in binary, so that the wire's compression finds the zeros."""
ROTATION_STEP = 2.0**-16
"""Quaternions likewise: 3e-5 rad, 0.03 mm at arm's length."""


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

    def points(self, handle: viser.ArrowsHandle, points: np.ndarray) -> None:
        """Assign an array of points [m], rounded to 1 mm: the length of an arrow is no gauge."""
        key, value = (handle.name, "points"), np.round(points, 3).astype(np.float32)
        before = self._sent.get(key)
        if before is None or not np.array_equal(before, value):
            self._sent[key] = value
            handle.points = value
            self.count += 1

    def forget(self, name: str) -> None:
        """Drop what is known of a node and its children: it is about to be made anew."""
        prefix = name + "/"
        for key in [k for k in self._sent if k[0] == name or k[0].startswith(prefix)]:
            del self._sent[key]


_NOTHING = object()
