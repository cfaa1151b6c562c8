"""The compiled path of the core's inner functions: the kernels behind `numpy_backend`'s names.

Importing this module imports numba and compiles, or loads, every kernel (seconds the first time,
a fraction of one from the cache).
"""

import numpy as np

from app.core import kernels
from app.core.belief import Evidence
from app.core.rotations import approach_axes
from app.core.settings import AssistanceSettings
from app.core.types import Array, Goals, Rows

__all__ = ["NAME", "evaluate", "exact_step", "fill_grid", "update"]

NAME: str = "compiled"


def evaluate(
    settings: AssistanceSettings, goals: Goals, x: Array, rows: Array, best_targets: Rows
) -> None:
    """`evaluation.evaluate`."""
    try:
        kernels.evaluate(
            settings.packed,
            goals.positions,
            goals.quaternions,
            goals.offsets,
            x,
            rows,
            best_targets,
        )
    except TypeError:
        evaluate(settings, _contiguous(goals), x, rows, best_targets)


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
    """`numpy_backend.update`."""
    try:
        return kernels.update(
            settings.packed,
            goals.positions,
            goals.quaternions,
            goals.offsets,
            x,
            log_belief,
            log_prior,
            evidence.weight,
            evidence.drift,
            evidence.decay,
            rows,
            best_targets,
            expected_gradient,
        )
    except TypeError:  # read-only, strided, or of another dtype: rare, so only looked at here
        return update(
            settings,
            _contiguous(goals),
            x,
            np.array(log_belief, dtype=np.float64),
            np.array(log_prior, dtype=np.float64),
            evidence,
            rows,
            best_targets,
            expected_gradient,
        )


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
    """`numpy_backend.fill_grid`."""
    own = _contiguous(goals)
    kernels.fill_grid(
        settings.packed,
        own.positions,
        approach_axes(own.quaternions),
        own.offsets,
        rotation_values,
        weights,
        start,
        u,
        v,
        temperature,
        np.empty((2, grid.shape[1])),
        grid,
    )


def exact_step(
    settings: AssistanceSettings, goals: Goals, x: Array, belief: Array, gradient: Array
) -> Array:
    """`exact.exact_step`."""
    best = np.empty(3)
    try:
        kernels.exact_step(
            settings.packed,
            goals.positions,
            goals.quaternions,
            goals.offsets,
            x,
            belief,
            gradient,
            settings.w_translation,
            np.empty((goals.n_targets, 8)),
            np.empty((kernels.STARTS, 3)),
            best,
        )
    except TypeError:
        arrays = (np.array(one, dtype=np.float64) for one in (x, belief, gradient))
        return exact_step(settings, _contiguous(goals), *arrays)
    return best


def _contiguous(goals: Goals) -> Goals:
    """Return the goals in fresh arrays of the layout the kernels were compiled for."""
    return Goals(
        goals.names,
        np.array(goals.positions, dtype=np.float64, order="C"),
        np.array(goals.quaternions, dtype=np.float64, order="C"),
        np.array(goals.offsets, dtype=np.int64),
    )
