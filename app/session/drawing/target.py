"""The ring on the table round the object that the person is asked to grasp."""

import numpy as np
import viser

from app.session.drawing.hand import circle
from app.session.drawing.outbox import Outbox
from app.session.drawing.palette import Theme, marker, rgb
from app.session.drawing.subject import Subject, SubjectError

RADIUS_M = 0.052
LIFT_M = 0.007  # [m] above the table, clear of the slice and of the plumb line's ring


class TargetNode:
    """Node `/hindsight/target_ring`; it stays on the table when the object is lifted."""

    def __init__(self, server: viser.ViserServer, subject: Subject, theme: Theme, outbox: Outbox):
        self._subject, self._theme, self._outbox = subject, theme, outbox
        self._goal: str | None = None
        self._ring = server.scene.add_line_segments(
            "/hindsight/target_ring",
            circle(RADIUS_M, 64).astype(np.float32),
            rgb(theme.line),
            thickness=3.0,
            thickness_units="screen",
            visible=False,
        )

    def set(self, goal: str | None) -> None:
        """Mark an object, or none.

        Raises:
            SubjectError: If the scene has no such object.
        """
        names = self._subject.object_names
        if goal is not None and goal not in names:
            raise SubjectError(f"there is no object {goal!r}; valid are: {', '.join(names)}")
        self._goal = goal
        self.set_theme(self._theme)
        self._outbox.put(self._ring, "visible", goal is not None)

    def set_theme(self, theme: Theme) -> None:
        """Put the ring into a theme's colours."""
        self._theme = theme
        if self._goal is not None:
            colour = marker(theme, self._subject.object_colour(self._goal))
            self._ring.colors = np.array(colour, dtype=np.uint8)

    def update(self, object_positions: np.ndarray) -> None:
        """Follow the marked object over the table; positions (n_objects, 3) [m]."""
        if self._goal is not None:
            x, y, _ = object_positions[self._subject.object_names.index(self._goal)]
            self._outbox.place(self._ring, [x, y, LIFT_M])
