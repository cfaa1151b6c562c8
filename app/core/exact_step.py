"""The exact step of one situation: where the descent of `exact.py` starts, and its answer."""

import numpy as np

from app.core.backend import active
from app.core.rotations import from_rotation_vector, multiply, rotation_between
from app.core.situation import Situation
from app.core.types import Array
from app.core.values import rotation_cost, value

RESTART_GOALS = 4  # likeliest goals a restart is made for
RESTART_TARGETS = 3  # nearest targets of each
SHORT_OF_TARGET = 0.9  # a start at the target itself would never leave the kink of c₀ d there


def exact_step(situation: Situation) -> Array:
    """Return the velocity s that minimises τ w |s|² + Σ_g b(g) V_g(y + τ s) [m/s], shape (3,)."""
    settings, goals, x = situation.settings, situation.goals, situation.x
    tau = settings.look_ahead
    turned = x[3:7] / np.sqrt(x[3:7] @ x[3:7])
    if x[10:].any():
        turned = multiply(from_rotation_vector(tau * x[10:]), turned)
    angles, _ = rotation_between(goals.quaternions, turned)
    rotation_values = settings.rotation_weight * value(angles, rotation_cost(settings))
    towards = goals.positions - (x[:3] + tau * x[7:10])
    starts = _starts(situation, towards)
    return active().descend(
        settings, towards, goals.offsets, rotation_values, situation.belief, starts
    )


def _starts(situation: Situation, towards: Array) -> Array:
    """Return velocities to start from: none, first order, and into the nearest targets, (n, 3)."""
    settings, offsets = situation.settings, situation.goals.offsets
    starts = [np.zeros(3), -situation.expected_gradient[:3] / (2.0 * settings.w_translation)]
    for goal in np.argsort(-situation.belief, kind="stable")[:RESTART_GOALS]:
        own = towards[offsets[goal] : offsets[goal + 1]]
        nearest = np.argsort((own**2).sum(axis=1), kind="stable")[:RESTART_TARGETS]
        starts.extend(SHORT_OF_TARGET / settings.look_ahead * own[nearest])
    return np.array(starts)
