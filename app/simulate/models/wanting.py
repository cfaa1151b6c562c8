"""Users who want something else than the assistance assumes: who change, stop, or go elsewhere."""

import numpy as np

from app.core.types import Array
from app.simulate.models.base import Action, Percept, Sight, User
from app.simulate.models.parameters import COMMON, Parameter
from app.simulate.models.pursuit import STILL


class ChangesMind(User):
    """Goes for another object first, and for the instructed one from somewhere on the way."""

    PARAMETERS = COMMON | {
        "change_at": Parameter(0.5, 0.0, 1.0, "share of the way to the first object that is made"),
    }
    OTHER_OBJECTS = 1
    _instructed = ""
    _first_distance = np.inf

    def act(self, sight: Sight) -> Action:
        """Choose the first object at the first sight."""
        if not self._instructed:
            self._instructed = self.goal
            others = [name for name in sight.goals.names if name != self.goal]
            self.goal = others[int(self._rng.integers(len(others)))]
        return super().act(sight)

    def intend(self, percept: Percept) -> Array:
        """Pursue the first object until enough of the way is made, then the other."""
        if self.goal != self._instructed:
            if not np.isfinite(self._first_distance):
                self._first_distance = percept.distance
            if percept.distance <= (1.0 - self.p["change_at"]) * self._first_distance + 1e-3:
                self.goal, self._grasp = self._instructed, -1
                return STILL  # a moment to think
        return self.pursue(percept)

    def _decide(self, sight: Sight) -> Action:
        action = super()._decide(sight)
        # Nobody closes the hand on what they do not want.
        return action if self.goal == self._instructed else Action(action.input)


class Idle(User):
    """Pushes for a moment, then lets go and only watches; closes if the hand arrives."""

    PARAMETERS = COMMON | {
        "push_s": Parameter(1.0, 0.0, 60.0, "how long the user pushes at the beginning [s]"),
    }

    def intend(self, percept: Percept) -> Array:
        """Pursue at the beginning only."""
        return self.pursue(percept) if percept.time_s < self.p["push_s"] else STILL


class Unmodelled(User):
    """Wants an object that the assistance does not know."""

    OTHER_OBJECTS = 1
    MODELLED = False

    def intend(self, percept: Percept) -> Array:
        """Pursue."""
        return self.pursue(percept)
