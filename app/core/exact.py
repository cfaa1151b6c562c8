"""The exact step of the policy in translation: argmin_s τ w |s|² + Σ_g b(g) V_g(y + τ s).

y = p + τD(u), s the assistance's velocity. With one target a goal the objective is convex and

    s = −(2w I + τ Σ k_g L_g²)⁻¹ Σ k_g L_g² (y − P_g),   k_g = b(g) C(d_g) / (v d_g),

d_g = |L_g (y + τ s − P_g)|, L = I unless metres aside of the approach count more (`values.py`),
iterated converges to its minimum: each pass minimises a quadratic that lies above the objective
and touches it at s (V is concave in d², and V_g ≤ V_κ for the target chosen). With many targets
the objective is not convex; the iteration is restarted from the nearest targets of the likeliest
goals and the best end is taken. `kernels.py` holds the same compiled.
"""

import numpy as np

from app.core.rotations import approach_axes, from_rotation_vector, multiply, rotation_between
from app.core.settings import AssistanceSettings
from app.core.types import Array, Goals, Rows
from app.core.values import cost_rate, rotation_cost, translation_cost, value, weigh

PASSES = 200
COARSE = 1e-6  # [m/s], where a start has come near enough to be compared
TOLERANCE = 1e-14  # [m/s], where the best of them ends
RESTART_GOALS = 4  # likeliest goals a restart is made for
RESTART_TARGETS = 3  # nearest targets of each
SHORT_OF_TARGET = 0.9  # a start at the target itself would never leave the kink of c₀ d there


def exact_step(
    settings: AssistanceSettings, goals: Goals, x: Array, belief: Array, gradient: Array
) -> Array:
    """Return the velocity s that minimises τ w |s|² + Σ_g b(g) V_g(y + τ s) [m/s], shape (3,).

    Args:
        settings: Costs, τ and w.
        goals: Goals with targets.
        x: Position [m], quaternion w x y z, and D(u) [m/s, rad/s], shape (13,).
        belief: b(g), shape (n_goals,).
        gradient: Σ_g b(g) ∇V_g(y), of which the first-order step follows, shape (6,).
    """
    tau = settings.look_ahead
    turned = x[3:7] / np.sqrt(x[3:7] @ x[3:7])
    if x[10:].any():
        turned = multiply(from_rotation_vector(tau * x[10:]), turned)
    angles, _ = rotation_between(goals.quaternions, turned)
    rotation_values = settings.rotation_weight * value(angles, rotation_cost(settings))
    towards = goals.positions - (x[:3] + tau * x[7:10])
    starts = [np.zeros(3), -gradient[:3] / (2.0 * settings.w_translation)]
    for goal in np.argsort(-belief, kind="stable")[:RESTART_GOALS]:
        own = towards[goals.offsets[goal] : goals.offsets[goal + 1]]
        nearest = np.argsort((own**2).sum(axis=1), kind="stable")[:RESTART_TARGETS]
        starts.extend(SHORT_OF_TARGET / tau * own[nearest])
    axes = approach_axes(goals.quaternions)
    return _descend(
        settings, towards, axes, goals.offsets, rotation_values, belief, np.array(starts)
    )


def _descend(
    settings: AssistanceSettings,
    towards: Array,
    axes: Array,
    offsets: Rows,
    rotation_values: Array,
    belief: Array,
    starts: Array,
) -> Array:
    """Return the best end of the iteration from all starts, a velocity [m/s], shape (3,).

    Args:
        settings: Costs, τ and w.
        towards: P_κ − y, from the hand after D(u) to every target [m], shape (n_targets, 3).
        axes: Approach axes of the targets, shape (n_targets, 3).
        offsets: First target of each goal and the end, shape (n_goals + 1,).
        rotation_values: m V_r of every target [nat], shape (n_targets,).
        belief: b(g), shape (n_goals,).
        starts: Velocities to start from [m/s], shape (n_starts, 3).
    """
    tau, w = settings.look_ahead, settings.w_translation
    cost, aside = translation_cost(settings), settings.translation_aside
    squares = weigh(weigh(np.eye(3), axes[:, None, :], aside), axes[:, None, :], aside)  # L²
    squares = np.broadcast_to(squares, (len(towards), 3, 3))

    def iterate(s: Array, tolerance: float) -> tuple[Array, Array]:
        for _ in range(PASSES):
            chosen, _ = _choose(settings, towards, axes, offsets, rotation_values, belief, s)
            way = weigh(towards[chosen] - tau * s[:, None, :], axes[chosen], aside)
            d = np.linalg.norm(way, axis=2)
            k = belief * cost_rate(d, cost) / (cost.speed * np.maximum(d, 1e-12))
            stiffness = 2.0 * w * np.eye(3) + tau * np.einsum("sg,sgij->sij", k, squares[chosen])
            pull = np.einsum("sg,sgij,sgj->si", k, squares[chosen], towards[chosen])
            following = np.linalg.solve(stiffness, pull[:, :, None])[..., 0]
            moved = np.abs(following - s).max()
            if moved < tolerance:
                break
            s = following
        _, expected = _choose(settings, towards, axes, offsets, rotation_values, belief, s)
        return s, tau * w * (s**2).sum(axis=1) + expected

    ends, objectives = iterate(starts, COARSE)
    best = int(np.argmin(objectives))
    return iterate(ends[best : best + 1], TOLERANCE)[0][0]


def _choose(
    settings: AssistanceSettings,
    towards: Array,
    axes: Array,
    offsets: Rows,
    rotation_values: Array,
    belief: Array,
    s: Array,
) -> tuple[Rows, Array]:
    """Return each goal's best target after s, (n_starts, n_goals), and Σ b V there, (n_starts,)."""
    way = towards - settings.look_ahead * s[:, None, :]
    distance = np.linalg.norm(weigh(way, axes, settings.translation_aside), axis=2)
    values = value(distance, translation_cost(settings)) + rotation_values
    chosen = np.empty((len(s), len(belief)), dtype=np.int64)
    expected = np.zeros(len(s))
    for goal, weight in enumerate(belief):
        own = values[:, offsets[goal] : offsets[goal + 1]]
        best = own.argmin(axis=1)
        chosen[:, goal] = offsets[goal] + best
        expected += weight * own[np.arange(len(s)), best]
    return chosen, expected
