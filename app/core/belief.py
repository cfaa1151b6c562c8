"""The belief over goals, from the user's inputs only.

p(g | u) ∝ p(g) exp(V_g(x) − Q_g(x, u)) over time, in log space. The executed motion never enters:
it would confirm itself. This is the numpy path; `kernels.py` holds the same compiled.
"""

import math
from dataclasses import dataclass

import numpy as np

from app.core.evaluation import BELIEF, COST, LOG_BELIEF, SOFT_AFTER, SOFT_BEFORE
from app.core.settings import AssistanceSettings
from app.core.types import Array


@dataclass(frozen=True, slots=True)
class Evidence:
    """How much this call counts.

    Attributes:
        weight: Of V^≈(x) − Q^≈(x, u): β dt/τ for `calibrated`; 1 or 0 for `paper`.
        drift: η dt [nat] while the user is idle, else 0.
        decay: 2^(−dt/half-life), what is left of earlier evidence.
    """

    weight: float
    drift: float
    decay: float


def calibrated(settings: AssistanceSettings, dt: float, elapsed: float) -> tuple[float, float]:
    """ℓ_g += β (dt/τ) [V_g^≈(x) − V_g^≈(x ⊕ τD(u))]: the same evidence at any control rate.

    Zero input changes nothing (the paper, Fig. 3a), since both values are then the same.

    Returns:
        The weight of this call's evidence, and the time [s] carried over to the next call.
    """
    return settings.beta * dt / settings.look_ahead, elapsed


def paper(settings: AssistanceSettings, dt: float, elapsed: float) -> tuple[float, float]:
    """ℓ_g += V_g^≈ − Q_g^≈ with the running cost, once per prediction period, as published.

    Because of the running cost it drifts toward a target near the hand with no input at all.
    """
    elapsed += dt
    if elapsed < settings.prediction_period - 1e-9:
        return 0.0, elapsed
    return 1.0, 0.0


PREDICTORS = {"calibrated": calibrated, "paper": paper}
"""Predictor → (settings, dt, elapsed) → (weight of the evidence, elapsed)."""


def initial_elapsed(settings: AssistanceSettings) -> float:
    """Return the elapsed time [s] at which a predictor with a period counts its first input."""
    return settings.prediction_period


def condition(
    settings: AssistanceSettings,
    rows: Array,
    log_belief: Array,
    log_prior: Array,
    evidence: Evidence,
) -> None:
    """Fill rows BELIEF and LOG_BELIEF from the rows of an evaluation and the belief before.

    Args:
        settings: Bounds of the belief and the costs that scale the idle drift.
        rows: An evaluation, shape (N_ROWS, n_goals).
        log_belief: log b(g) before, normalised, shape (n_goals,).
        log_prior: log p(g), the belief that aged evidence returns to, shape (n_goals,).
        evidence: How much this call counts.
    """
    change = evidence.weight * (rows[SOFT_BEFORE] - rows[SOFT_AFTER])
    if evidence.drift != 0.0:
        # η dt (1 − C/C_far): nothing far away, most at a target
        far = settings.translation_alpha + settings.translation_offset
        far += settings.rotation_weight * (settings.rotation_alpha + settings.rotation_offset)
        if far > 0.0:
            change = change + evidence.drift * (1.0 - rows[COST] / far)
    if evidence.decay != 1.0:
        change = change + (evidence.decay - 1.0) * (log_belief - log_prior)
    if not change.any():  # exactly unchanged: not even by rounding
        rows[LOG_BELIEF] = log_belief
    else:
        rows[LOG_BELIEF] = bounded(
            log_belief + change,
            settings.belief_max,
            settings.belief_floor,
            settings.belief_surplus == "equal",
        )
    rows[BELIEF] = np.exp(rows[LOG_BELIEF])


def bounded(log_weights: Array, highest: float, lowest: float, equal: bool) -> Array:
    """Return log b(g): weights normalised, every goal at least `lowest`, none above `highest`.

    Floors together never take more than what the cap leaves (at least 1 %): with many goals the
    floor is min(lowest, max(1 − highest, 0.01)/(n − 1)).

    Args:
        log_weights: log of the weights, any scale, shape (n_goals,).
        highest: Cap; a single goal is exempt.
        lowest: Floor, 0 for none.
        equal: Whether what the cap takes is shared in equal parts (`ada`) or in proportion.
    """
    n = len(log_weights)
    log_b = log_weights - _log_sum_exp(log_weights)
    if n == 1:
        return np.zeros(1)
    floor = min(lowest, max(1.0 - highest, 0.01) / (n - 1))
    if floor > 0.0:
        b = np.exp(log_b)
        if b.min() < floor:
            log_b = np.log(_raised(b, floor))
    top = int(np.argmax(log_b))
    if log_b[top] > math.log(highest):
        others = np.delete(log_b, top)
        if equal:
            surplus = math.exp(log_b[top]) - highest
            others = np.log(np.exp(others) + surplus / (n - 1))
        else:
            others = others - _log_sum_exp(others) + math.log1p(-highest)
        log_b = np.insert(others, top, math.log(highest))
    return log_b


def _raised(b: Array, floor: float) -> Array:
    """Return b with everything below `floor` raised to it and the rest scaled down to sum to 1."""
    scale = 1.0
    for _ in range(len(b)):
        low = b * scale < floor
        smaller = (1.0 - floor * np.count_nonzero(low)) / b[~low].sum()
        if smaller == scale:
            break
        scale = smaller
    return np.maximum(b * scale, floor)


def _log_sum_exp(values: Array) -> float:
    top = values.max()
    return float(top + math.log(np.exp(values - top).sum()))
