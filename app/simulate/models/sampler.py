"""A user who samples from the very policy the prediction assumes."""

import numpy as np

from app.core import AssistanceSettings
from app.core.types import Array
from app.core.values import rotation_cost, translation_cost, value
from app.simulate.models.base import DECISION_S, Percept, User
from app.simulate.models.parameters import COMMON, Parameter

_COSTS = AssistanceSettings()
_SIDES = (-1.0, 0.0, 1.0)
_DIRECTIONS = np.array([(x, y, z) for x in _SIDES for y in _SIDES for z in _SIDES])
_DIRECTIONS /= np.maximum(1.0, np.sqrt((_DIRECTIONS**2).sum(axis=1)))[:, None]
_PUSHES = _DIRECTIONS[_DIRECTIONS.any(axis=1)]
_INPUTS = np.concatenate([np.zeros((1, 3)), 0.5 * _PUSHES, _PUSHES])
"""Unit inputs that are chosen from: rest, and 26 directions at half and full vigour, (53, 3)."""


class MaxEnt(User):
    """Samples u from p(u | x, g) ∝ exp(−β [V_g(x ⊕ τD(u)) − V_g(x)]), the paper's user model.

    V_g is the least over the grasps (Theorem 1) with the default costs; one sample is held for
    `hold_s`. There is no other noise.
    """

    PARAMETERS = COMMON | {
        "noise": Parameter(0.0, 0.0, 3.0, COMMON["noise"].about),
        "vigour": Parameter(0.5, 0.02, 1.0, "largest deflection sampled, full stick = 1"),
        "rationality": Parameter(192.0, 0.0, 1e4, "β, evidence per nat of progress over τ = 0.1 s"),
        "hold_s": Parameter(0.12, 0.04, 2.0, "how long one sample is held [s]"),
        "full_stick_m_s": Parameter(0.2, 0.01, 2.0, "speed the user expects of a full stick [m/s]"),
    }
    _held = np.zeros(3)
    _left = 0

    def intend(self, percept: Percept) -> Array:
        """Sample an input, or hold the last one."""
        uniform = float(self._rng.random())
        if self._left <= 0:
            self._held = self._sample(percept, uniform)
            self._left = max(1, round(self.p["hold_s"] / DECISION_S))
        self._left -= 1
        return self._held

    def _sample(self, percept: Percept, uniform: float) -> Array:
        goals = percept.sight.goals
        row = goals.names.index(self.goal)
        rows = slice(goals.offsets[row], goals.offsets[row + 1])
        inputs = self.p["vigour"] * _INPUTS
        after = percept.pose.position + _COSTS.look_ahead * self.p["full_stick_m_s"] * inputs
        offsets = goals.positions[rows] - after[:, None, :]
        distances = np.sqrt(np.einsum("ijk,ijk->ij", offsets, offsets))
        dots = np.abs(goals.quaternions[rows] @ percept.pose.quaternion)
        angles = 2.0 * np.arccos(np.minimum(dots, 1.0))
        turned = _COSTS.rotation_weight * value(angles, rotation_cost(_COSTS))
        values = (value(distances, translation_cost(_COSTS)) + turned).min(axis=1)
        weights = np.exp(-self.p["rationality"] * (values - values.min()))
        chosen = np.searchsorted(np.cumsum(weights), uniform * weights.sum(), side="right")
        return inputs[min(int(chosen), len(inputs) - 1)]
