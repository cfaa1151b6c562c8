"""The exact step of the policy in translation: argmin_s τ w |s|² + Σ_g b(g) V_g(y + τ s).

y = p + τD(u), s the assistance's velocity. With one target a goal the objective is convex and

    s = −Σ k_g (y − P_g) / (2w + τ Σ k_g),   k_g = b(g) C(d_g) / (v d_g),   d_g = |y + τ s − P_g|

iterated converges to its minimum: each pass minimises a quadratic that lies above the objective
and touches it at s (V is concave in d², and V_g ≤ V_κ for the target chosen). With many targets
the objective is not convex; the iteration is restarted from the nearest targets of the likeliest
goals and the best end is taken. `exact_kernel.py` holds the descent compiled.
"""

import numpy as np

from app.core.settings import AssistanceSettings
from app.core.types import Array, Rows
from app.core.values import cost_rate, translation_cost, value

PASSES = 200
TOLERANCE = 1e-14  # [m/s]


def descend(
    settings: AssistanceSettings,
    towards: Array,
    offsets: Rows,
    rotation_values: Array,
    belief: Array,
    starts: Array,
) -> Array:
    """Return the best end of the iteration from all starts, a velocity [m/s], shape (3,).

    Args:
        settings: Costs, τ and w.
        towards: P_κ − y, from the hand after D(u) to every target [m], shape (n_targets, 3).
        offsets: First target of each goal and the end, shape (n_goals + 1,).
        rotation_values: m V_r of every target [nat], shape (n_targets,).
        belief: b(g), shape (n_goals,).
        starts: Velocities to start from [m/s], shape (n_starts, 3).
    """
    tau, w = settings.look_ahead, settings.w_translation
    cost = translation_cost(settings)
    s = starts
    for _ in range(PASSES):
        chosen, _ = _choose(settings, towards, offsets, rotation_values, belief, s)
        d = np.linalg.norm(towards[chosen] - tau * s[:, None, :], axis=2)
        k = belief * cost_rate(d, cost) / (cost.speed * np.maximum(d, 1e-12))
        following = np.einsum("sg,sgi->si", k, towards[chosen])
        following /= (2.0 * w + tau * k.sum(axis=1))[:, None]
        moved = np.abs(following - s).max()
        if moved < TOLERANCE:
            break
        s = following
    _, expected = _choose(settings, towards, offsets, rotation_values, belief, s)
    objective = tau * w * (s**2).sum(axis=1) + expected
    return s[int(np.argmin(objective))]


def _choose(
    settings: AssistanceSettings,
    towards: Array,
    offsets: Rows,
    rotation_values: Array,
    belief: Array,
    s: Array,
) -> tuple[Rows, Array]:
    """Return each goal's best target after s, (n_starts, n_goals), and Σ b V there, (n_starts,)."""
    distance = np.linalg.norm(towards - settings.look_ahead * s[:, None, :], axis=2)
    values = value(distance, translation_cost(settings)) + rotation_values
    chosen = np.empty((len(s), len(belief)), dtype=np.int64)
    expected = np.zeros(len(s))
    for goal, weight in enumerate(belief):
        own = values[:, offsets[goal] : offsets[goal + 1]]
        best = own.argmin(axis=1)
        chosen[:, goal] = offsets[goal] + best
        expected += weight * own[np.arange(len(s)), best]
    return chosen, expected
