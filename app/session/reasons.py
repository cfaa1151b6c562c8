"""Why a goal became more or less probable, in a few words.

The evidence for goal g in a tick of the calibrated predictor is β dt/τ [V_g(x) − V_g(x ⊕ τD(u))]
≈ s_g c_g |v|: the slope s of the goal's cost-to-go, which depends on distance alone (flat beyond
δ), times the cosine c between the push and the way to it. Relative to the belief-weighted mean m
of all goals the difference splits exactly into a part from direction and one from distance,

    s_g c_g − s_m c_m = ½ (s_g + s_m)(c_g − c_m) + ½ (c_g + c_m)(s_g − s_m).

The predictor `paper` adds −C(d_g): a goal near the hand gains although nothing is pushed, which
counts as distance too. Parts are summed over the last half second of change.
"""

import math

import numpy as np

from app.core.types import Array
from app.core.values import cost_rate, translation_cost
from app.session.frame import Frame

MEMORY_S = 0.5
NOTICEABLE = 0.02
"""Smallest change of a probability that is worth a reason."""


class Reasons:
    """Remembers the causes of recent changes; call `update` with frames in order."""

    def __init__(self) -> None:
        self._texts: dict[str, str] = {}
        self._key: tuple[object, ...] = ()
        self._time_s = -math.inf
        self._direction: Array = np.zeros(0)
        self._distance: Array = np.zeros(0)
        self._anchor: Array = np.zeros(0)

    def update(self, frame: Frame) -> dict[str, str]:
        """The reasons after this frame: goal → text; goals that never changed are left out."""
        view, record = frame.view, frame.record
        belief = np.array(record.belief)
        key = (view.number, view.target, view.goal_names)
        if key != self._key:
            self._key, self._texts, self._time_s = key, {}, record.time_s
            self._direction, self._distance = np.zeros(len(belief)), np.zeros(len(belief))
            self._anchor = belief
        passed = record.time_s - self._time_s
        if passed <= 0.0 or record.phase != "running":
            return dict(self._texts)
        self._time_s = record.time_s
        direction, distance = evidence_parts(frame, belief)
        keep = math.exp(-passed / MEMORY_S)
        self._direction = keep * self._direction + passed * direction
        self._distance = keep * self._distance + passed * distance
        change = belief - self._anchor
        for g in np.flatnonzero(np.abs(change) >= NOTICEABLE):
            self._texts[view.goal_names[g]] = self._explain(int(g), change[g], frame)
            self._anchor[g] = belief[g]
        return dict(self._texts)

    def _explain(self, g: int, change: float, frame: Frame) -> str:
        up = change > 0
        by_direction, by_distance = self._direction[g], self._distance[g]
        if not up:
            by_direction, by_distance = -by_direction, -by_distance
        rival = int(np.argmax(np.where(np.arange(len(self._anchor)) == g, -1, frame.record.belief)))
        other = frame.view.goal_names[rival] if len(self._anchor) > 1 else "another object"
        if by_distance > by_direction:
            return "the hand is near it" if up else f"the hand is nearer to the {other}"
        if up:
            return "you push toward it"
        if _cosines(frame)[g] < 0:
            return "you push away from it"
        return f"you push more toward the {other}"


def evidence_parts(frame: Frame, belief: Array) -> tuple[Array, Array]:
    """Evidence per goal [nat/s, up to a factor common to all], from direction and from distance.

    Args:
        frame: The tick.
        belief: b(g), the weights of the mean that goals are compared with, shape (n_goals,).
    """
    settings = frame.settings
    distances, cosines = _distances(frame), _cosines(frame)
    cost = cost_rate(distances, translation_cost(settings))
    slopes = cost / settings.translation_speed
    speed = math.hypot(*frame.record.direct_twist[:3])
    mean_slope, mean_cosine = float(belief @ slopes), float(belief @ cosines)
    direction = 0.5 * speed * (slopes + mean_slope) * (cosines - mean_cosine)
    distance = 0.5 * speed * (cosines + mean_cosine) * (slopes - mean_slope)
    if settings.predictor == "paper":
        distance = distance - (cost - float(belief @ cost))
    return direction, distance


def _way(frame: Frame) -> Array:
    """From the hand to the target that each goal would be grasped at [m], (n_goals, 3)."""
    hand = np.array(frame.record.hand_position_m)
    return frame.goals.positions[frame.record.best_targets] - hand


def _distances(frame: Frame) -> Array:
    return np.linalg.norm(_way(frame), axis=1)


def _cosines(frame: Frame) -> Array:
    way = _way(frame)
    push = np.array(frame.record.direct_twist[:3])
    norms = np.linalg.norm(way, axis=1) * np.linalg.norm(push)
    return np.divide(way @ push, norms, out=np.zeros(len(way)), where=norms > 1e-12)
