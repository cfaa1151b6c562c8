"""The numpy path of the core's inner functions; the compiled one is `compiled_backend.py`."""

import numpy as np

from app.core.belief import Evidence, condition
from app.core.checks import SMALLEST_QUATERNION
from app.core.evaluation import BELIEF, GRADIENT, evaluate, soft_min
from app.core.exact import exact_step
from app.core.rotations import approach_axes
from app.core.settings import AssistanceSettings
from app.core.types import Array, Goals, Rows
from app.core.values import translation_cost, value, weigh

__all__ = ["NAME", "evaluate", "exact_step", "fill_grid", "update"]

NAME: str = "numpy"


def update(
    settings: AssistanceSettings,
    goals: Goals,
    x: Array,
    log_belief: Array,
    log_prior: Array,
    evidence: Evidence,
    rows: Array,
    best_targets: Rows,
    expected_gradient: Array,
) -> bool:
    """Evaluate, condition the belief, and sum the gradients Σ b ∇V; the whole of one tick.

    Args:
        settings: As `evaluate` and `condition`.
        goals: As `evaluate`.
        x: As `evaluate`.
        log_belief: As `condition`.
        log_prior: As `condition`.
        evidence: As `condition`.
        rows: Result, shape (N_ROWS, n_goals).
        best_targets: Result, shape (n_goals,).
        expected_gradient: Result [nat/m, nat/rad], shape (6,).

    Returns:
        Whether the input was valid: finite numbers, a quaternion that names a rotation.
    """
    if not x[3:7] @ x[3:7] > SMALLEST_QUATERNION**2 or not np.isfinite(x).all():
        return False
    if not _consistent(goals):
        return False
    evaluate(settings, goals, x, rows, best_targets)
    if not np.isfinite(rows[:BELIEF]).all():
        return False
    condition(settings, rows, log_belief, log_prior, evidence)
    expected_gradient[:] = rows[GRADIENT : GRADIENT + 6] @ rows[BELIEF]
    return True


def _consistent(goals: Goals) -> bool:
    n, ends = len(goals.positions), goals.offsets
    if len(ends) != goals.n_goals + 1 or ends[0] != 0 or ends[-1] != n or np.diff(ends).min() < 1:
        return False
    if goals.positions.shape != (n, 3) or goals.quaternions.shape != (n, 4):
        return False
    return bool(np.isfinite(goals.positions).all() and np.isfinite(goals.quaternions).all())


def fill_grid(
    settings: AssistanceSettings,
    goals: Goals,
    rotation_values: Array,
    weights: Array,
    start: Array,
    u: Array,
    v: Array,
    temperature: float,
    grid: Array,
) -> None:
    """Fill `grid` with Σ_g weights(g) V_g on a plane (`slices.value_slice`)."""
    cost, axes = translation_cost(settings), approach_axes(goals.quaternions)
    along_v = np.linspace(0.0, 1.0, grid.shape[1])[:, None] * v
    for i, share in enumerate(np.linspace(0.0, 1.0, grid.shape[0])):
        points = start + share * u + along_v
        grid[i] = 0.0
        for goal in np.flatnonzero(weights):
            own = slice(goals.offsets[goal], goals.offsets[goal + 1])
            way = points[:, None, :] - goals.positions[own]
            distance = np.linalg.norm(weigh(way, axes[own], settings.translation_aside), axis=2)
            values = value(distance, cost) + rotation_values[own]
            one_goal = np.array([0, values.shape[1]])
            if temperature == 0.0:
                grid[i] += weights[goal] * values.min(axis=1)
            else:
                soft = [soft_min(row, one_goal, temperature)[0] for row in values]
                grid[i] += weights[goal] * np.array(soft)
