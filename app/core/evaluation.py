"""V, Q and gradients of every goal at one pose, over all targets at once (the numpy path).

Goals from targets: V_g = min_κ V_κ, and Q_g with the target that is best AFTER the action (the
paper's Theorem 1), for assistance; the soft-min over targets (Theorem 2) for prediction.
`kernels.py` holds the same in compiled loops; tests hold the two equal to 1e-12.
"""

import numpy as np

from app.core.rotations import approach_axes, from_rotation_vector, multiply, rotation_between
from app.core.settings import AssistanceSettings
from app.core.types import Array, Goals, Rows
from app.core.values import cost_rate, rotation_cost, slope, translation_cost, value, weigh

# Rows of an evaluation, one column a goal.
VALUE = 0  # V_g(x) [nat]
Q_VALUE = 1  # Q_g(x, u) = τ C_κ*(x) + V_κ*(x ⊕ τD(u)), κ* best after the action [nat]
DISTANCE = 2  # to the goal's nearest target [m]
COST = 3  # running cost at the best target at x [nat/s]
SOFT_BEFORE = 4  # soft-min over targets of V_κ(x) [nat]
SOFT_AFTER = 5  # soft-min of V_κ(x ⊕ τD(u)), plus τ C_κ(x) for the predictor `paper` [nat]
GRADIENT = 6  # rows 6…11: ∇V_g(x ⊕ τD(u)) [nat/m, nat/rad], world frame
BELIEF = 12
LOG_BELIEF = 13
N_ROWS = 14


def soft_min(values: Array, offsets: Rows, temperature: float) -> Array:
    """Return −T log Σ_κ exp(−V_κ/T) per goal, the minimum where T = 0.

    Args:
        values: V_κ [nat], shape (n_targets,).
        offsets: First target of each goal and the end, shape (n_goals + 1,).
        temperature: T; 1 is the paper's Theorem 2.
    """
    starts = offsets[:-1]
    least = np.minimum.reduceat(values, starts)
    if temperature == 0.0:
        return least
    scaled = (np.repeat(least, np.diff(offsets)) - values) / temperature
    return least - temperature * np.log(np.add.reduceat(np.exp(scaled), starts))


def first_min(values: Array, least: Array, offsets: Rows) -> Rows:
    """Return per goal the row of the first target whose value is the goal's `least`."""
    rows = np.flatnonzero(values == np.repeat(least, np.diff(offsets)))
    return rows[np.searchsorted(rows, offsets[:-1])]


def evaluate(
    settings: AssistanceSettings, goals: Goals, x: Array, rows: Array, best_targets: Rows
) -> None:
    """Fill `rows` and `best_targets` (per goal the target best after the action).

    Args:
        settings: Costs, look-ahead τ, predictor and temperature.
        goals: Goals with targets.
        x: Position [m], quaternion w x y z, and D(u) [m/s, rad/s], shape (13,).
        rows: Result, shape (≥ 12, n_goals), in the order of the constants above.
        best_targets: Result, int64, shape (n_goals,).
    """
    tau, weight = settings.look_ahead, settings.rotation_weight
    translation, rotation = translation_cost(settings), rotation_cost(settings)
    offsets, starts = goals.offsets, goals.offsets[:-1]
    quaternion = x[3:7] / np.sqrt(x[3:7] @ x[3:7])

    axes, aside = approach_axes(goals.quaternions), settings.translation_aside
    way = goals.positions - x[:3]
    distance = np.sqrt((weigh(way, axes, aside) ** 2).sum(axis=1))
    angle, axis_after = rotation_between(goals.quaternions, quaternion)
    before = value(distance, translation) + weight * value(angle, rotation)

    weighed_after = weigh(x[:3] + tau * x[7:10] - goals.positions, axes, aside)
    distance_after = np.sqrt((weighed_after**2).sum(axis=1))
    angle_after = angle
    if x[10:].any():
        turned = multiply(from_rotation_vector(tau * x[10:]), quaternion)
        angle_after, axis_after = rotation_between(goals.quaternions, turned)
    after = value(distance_after, translation) + weight * value(angle_after, rotation)

    rates = cost_rate(distance, translation) + weight * cost_rate(angle, rotation)
    least, least_after = np.minimum.reduceat(before, starts), np.minimum.reduceat(after, starts)
    best = first_min(after, least_after, offsets)
    best_targets[:] = best
    rows[VALUE] = least
    rows[Q_VALUE] = tau * rates[best] + least_after
    rows[DISTANCE] = np.minimum.reduceat(np.sqrt((way**2).sum(axis=1)), starts)
    rows[COST] = rates[first_min(before, least, offsets)]
    rows[SOFT_BEFORE] = soft_min(before, offsets, settings.temperature)
    if settings.predictor == "paper" and settings.temperature == 0.0:
        rows[SOFT_AFTER] = rows[Q_VALUE]  # Theorem 1's Q, not the least of the sums
    else:
        running = tau * rates if settings.predictor == "paper" else 0.0
        rows[SOFT_AFTER] = soft_min(after + running, offsets, settings.temperature)

    d, r, n = distance_after[best], angle_after[best], axis_after[best]
    downhill = weigh(weighed_after[best], axes[best], aside)  # ∇(|L e|²/2) = L L e
    rows[GRADIENT : GRADIENT + 3] = _along(downhill, d, slope(d, translation)).T
    sine = np.sqrt((n**2).sum(axis=1))
    rows[GRADIENT + 3 : GRADIENT + 6] = _along(-n, sine, weight * slope(r, rotation)).T


def _along(vectors: Array, lengths: Array, size: Array) -> Array:
    """Return vectors scaled from their `lengths` to `size`; zero where the length is zero."""
    return vectors * (size / np.where(lengths > 0.0, lengths, np.inf))[:, None]
