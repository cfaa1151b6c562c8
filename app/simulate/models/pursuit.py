"""Pursuit of the nearest grasp, and what the paper's participants made of the assistance."""

import numpy as np

from app.core.types import Array
from app.simulate.models.base import Percept, User
from app.simulate.models.parameters import COMMON, Parameter

STILL = np.zeros(3)


class Continue(User):
    """Pushes toward the goal all the way, whatever the robot does."""

    def intend(self, percept: Percept) -> Array:
        """Pursue."""
        return self.pursue(percept)


class Lazy(User):
    """Lets go while the robot is seen moving the right way (paper, Fig. 8)."""

    PARAMETERS = COMMON | {
        "content_cosine": Parameter(
            0.6, -1.0, 1.0, "cosine of seen motion and wish from which the robot may go on"
        ),
        "content_m_s": Parameter(0.02, 0.0, 0.5, "speed from which the robot seems to move [m/s]"),
    }

    def intend(self, percept: Percept) -> Array:
        """Pursue, unless the hand is on its way without that."""
        wish = self.pursue(percept)
        along = float(wish @ percept.velocity)
        speed = float(np.sqrt(percept.velocity @ percept.velocity))
        size = float(np.sqrt(wish @ wish))
        # Near the grasp the robot slows down, too; what counts as moving shrinks with the wish.
        moving = speed > self.p["content_m_s"] * min(1.0, size / self.p["vigour"])
        return STILL if moving and along > self.p["content_cosine"] * speed * size else wish


class Fight(User):
    """Pushes back against motion that was not asked for (paper, Fig. 9)."""

    PARAMETERS = COMMON | {
        "resistance": Parameter(
            1.0, 0.0, 5.0, "how much of unwanted motion is pushed back, 1: as fast as it is"
        ),
        "full_stick_m_s": Parameter(0.2, 0.01, 2.0, "speed the user expects of a full stick [m/s]"),
    }

    def intend(self, percept: Percept) -> Array:
        """Pursue, minus what the hand was seen to do beside or against the wish."""
        wish = self.pursue(percept)
        size = float(np.sqrt(wish @ wish))
        if size == 0.0:
            return wish
        direction = wish / size
        along = float(percept.velocity @ direction)
        unwanted = percept.velocity - max(0.0, along) * direction
        pushed = wish - self.p["resistance"] * unwanted / self.p["full_stick_m_s"]
        # No one presses harder against the robot than twice the usual.
        return pushed * min(1.0, 2.0 * self.p["vigour"] / float(np.sqrt(pushed @ pushed) + 1e-12))
