"""The exact step of the policy in translation: argmin_s τ w |s|² + Σ_g b(g) V_g(y + τ s).

y = p + τD(u), s the assistance's velocity. With one target a goal the objective is convex and

    s = −Σ k_g (y − P_g) / (2w + τ Σ k_g),   k_g = b(g) C(d_g) / (v d_g),   d_g = |y + τ s − P_g|

iterated converges to its minimum: each pass minimises a quadratic that lies above the objective
and touches it at s (V is concave in d², and V_g ≤ V_κ for the target chosen). With many targets
the objective is not convex; the iteration is restarted from the nearest targets of the likeliest
goals and the best end is taken.
"""

import numpy as np

from app.core.rotations import from_rotation_vector, multiply, rotation_between
from app.core.situation import Situation
from app.core.types import Array, Rows
from app.core.values import cost_rate, rotation_cost, translation_cost, value

RESTART_GOALS = 4  # likeliest goals a restart is made for
RESTART_TARGETS = 3  # nearest targets of each
SHORT_OF_TARGET = 0.9  # a start at the target itself would never leave the kink of c₀ d there
MAX_PASSES = 200
TOLERANCE = 1e-13  # [m/s]


def exact_step(situation: Situation) -> Array:
    """Return the velocity s that minimises the objective [m/s], shape (3,)."""
    settings, goals, x = situation.settings, situation.goals, situation.x
    tau, w = settings.look_ahead, settings.w_translation
    cost = translation_cost(settings)
    y = x[:3] + tau * x[7:10]
    turned = multiply(from_rotation_vector(tau * x[10:]), x[3:7])
    angles, _ = rotation_between(goals.quaternions, turned)
    rotation_values = settings.rotation_weight * value(angles, rotation_cost(settings))
    towards = goals.positions - y

    s = _starts(situation, towards)
    chosen = np.empty((len(s), goals.n_goals), dtype=np.int64)
    for _ in range(MAX_PASSES):
        expected = _choose(situation, s, towards, rotation_values, chosen)
        d = np.linalg.norm(towards[chosen] - tau * s[:, None, :], axis=2)
        k = situation.belief * cost_rate(d, cost) / (cost.speed * np.maximum(d, 1e-12))
        following = np.einsum("sg,sgi->si", k, towards[chosen])
        following /= (2.0 * w + tau * k.sum(axis=1))[:, None]
        moved = np.abs(following - s).max()
        s = following
        if moved < TOLERANCE:
            break
    expected = _choose(situation, s, towards, rotation_values, chosen)
    objective = tau * w * (s**2).sum(axis=1) + expected
    return s[int(np.argmin(objective))]


def _starts(situation: Situation, towards: Array) -> Array:
    """Return velocities to start from: none, first order, and into the nearest targets, (n, 3)."""
    settings, offsets = situation.settings, situation.goals.offsets
    starts = [np.zeros(3), -situation.expected_gradient[:3] / (2.0 * settings.w_translation)]
    for goal in np.argsort(-situation.belief, kind="stable")[:RESTART_GOALS]:
        own = towards[offsets[goal] : offsets[goal + 1]]
        nearest = np.argsort((own**2).sum(axis=1), kind="stable")[:RESTART_TARGETS]
        starts.extend(SHORT_OF_TARGET / settings.look_ahead * own[nearest])
    return np.array(starts)


def _choose(
    situation: Situation, s: Array, towards: Array, rotation_values: Array, chosen: Rows
) -> Array:
    """Fill `chosen` with each goal's best target after s; return Σ b V there, shape (n_starts,)."""
    settings, offsets = situation.settings, situation.goals.offsets
    distance = np.linalg.norm(towards - settings.look_ahead * s[:, None, :], axis=2)
    values = value(distance, translation_cost(settings)) + rotation_values
    expected = np.zeros(len(s))
    for goal, weight in enumerate(situation.belief):
        own = values[:, offsets[goal] : offsets[goal + 1]]
        best = own.argmin(axis=1)
        chosen[:, goal] = offsets[goal] + best
        expected += weight * own[np.arange(len(s)), best]
    return expected
