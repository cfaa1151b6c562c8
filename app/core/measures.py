"""What is measured on a trial, in the same words for live, simulated, reviewed and analysed trials.

All measures read columns of the steps of one trial: a mapping from the field names of the step
record to arrays with one row per tick. Only ticks with phase "running" count: from the start signal
(the arm is released) to the command that closes the hand.

A measure that is undefined (nothing was pushed, the goal is not modelled) is NaN, never 0.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt

from app.core.types import Array

CONFIDENT = 0.8
"""Belief from which the system counts as confident of a goal [1]."""

STILL_LINEAR = 1e-3
STILL_ANGULAR = 5e-3
"""Executed speeds below both count as standing still [m/s], [rad/s]."""

COLUMNS = (
    "phase",
    "input_norm",
    "direct_twist",
    "assistance_twist",
    "executed_twist",
    "belief",
)
"""The columns that `compute_measures` reads; a reader need load no others."""


@dataclass(frozen=True, slots=True)
class Measures:
    """The measures of one trial; NaN where undefined.

    Attributes:
        time_s: From the start signal to the command that closes the hand [s].
        input_s: ∫ ‖u‖₂ dt over all stick axes after the dead zone, full stick = 1 [s].
        felt_control: Mean cosine of user input and executed motion while pushing, weighted by |u|,
            in [−1, 1]. Both are compared in the part of the twist that the user commands (velocity
            or rotation rate); a push that nothing answers counts as 0.
        opposed: Share of the pushing time with assistance · input < 0, in [0, 1].
        idle_motion: Share of the moving time without input, in [0, 1].
        wrong_way_m: Path of the hand executed against a push: ∫ max(0, −v · û) dt [m].
        cancel_s: Mean time from the onset of a push against the executed motion until the executed
            motion no longer opposes it [s]; pushes released before that are not counted.
        correct_s: Time until the right goal leads for good [s].
        wrong_confident_s: Time with a belief ≥ 0.8 in a wrong goal [s].
        log_loss: Mean −ln p(right goal) over the trial [nat].
        brier: Mean Σ_g (b(g) − [g is right])² over the trial, in [0, 2].
    """

    time_s: float
    input_s: float
    felt_control: float
    opposed: float
    idle_motion: float
    wrong_way_m: float
    cancel_s: float
    correct_s: float
    wrong_confident_s: float
    log_loss: float
    brier: float

    def to_dict(self) -> dict[str, float]:
        """The measures by name, in the order of the trials table."""
        return asdict(self)


MEASURE_NAMES = tuple(Measures.__dataclass_fields__)


def compute_measures(
    columns: Mapping[str, npt.ArrayLike], *, true_goal: int | None, dt: float
) -> Measures:
    """Measure one trial.

    Args:
        columns: Arrays with one row per tick, at least those of COLUMNS: phase (n,) text,
            input_norm (n,) [1], the twists (n, 6) [m/s, rad/s], belief (n, n_goals) [1].
        true_goal: Index of the instructed goal among the modelled ones; None where it is not
            modelled, which leaves the measures of the belief undefined, but for the time confident
            of a wrong goal.
        dt: Control period [s].
    """
    running = np.asarray(columns["phase"]).astype(str) == "running"
    pushed = _rows(columns["input_norm"], running)
    direct = _rows(columns["direct_twist"], running)
    executed = _rows(columns["executed_twist"], running)
    assistance = _rows(columns["assistance_twist"], running)
    belief = _rows(columns["belief"], running)
    return Measures(
        time_s=float(len(pushed)) * dt,
        input_s=float(pushed.sum()) * dt,
        felt_control=_felt_control(pushed, direct, executed),
        opposed=_share(np.einsum("ij,ij->i", assistance, direct) < 0.0, pushed > 0.0),
        idle_motion=_share(pushed <= 0.0, _moving(executed)),
        wrong_way_m=_wrong_way(pushed, direct, executed, dt),
        cancel_s=_cancel_time(pushed, direct, executed, dt),
        **_measure_belief(belief, true_goal, dt),
    )


def calibration_counts(
    belief: npt.ArrayLike, true_goal: int, n_bins: int = 10
) -> tuple[Array, Array, Array]:
    """Count how often goals held with a probability were the right one.

    Every goal of every tick is one forecast. Counts of several trials add up; the observed
    frequency of a bin is hits / counts, its mean forecast probability_sums / counts.

    Args:
        belief: b(g) over ticks [1], shape (n, n_goals).
        true_goal: Index of the right goal.
        n_bins: Number of bins of equal width over [0, 1].

    Returns:
        Counts, sums of the probabilities and hits per bin, each of shape (n_bins,).
    """
    probabilities = np.asarray(belief, dtype=float)
    bins = np.minimum((probabilities * n_bins).astype(int), n_bins - 1)
    right = np.zeros(probabilities.shape)
    right[:, true_goal] = 1.0
    counts = np.bincount(bins.ravel(), minlength=n_bins).astype(float)
    sums = np.bincount(bins.ravel(), probabilities.ravel(), n_bins).astype(float)
    hits = np.bincount(bins.ravel(), right.ravel(), n_bins).astype(float)
    return counts, sums, hits


def _rows(column: npt.ArrayLike, running: npt.NDArray[np.bool_]) -> Array:
    return np.asarray(column, dtype=float)[running]


def _share(event: npt.NDArray[np.bool_], among: npt.NDArray[np.bool_]) -> float:
    """Share of the ticks `among` in which `event` holds; NaN where there are none."""
    return float(np.mean(event[among])) if among.any() else float("nan")


def _moving(twist: Array) -> npt.NDArray[np.bool_]:
    linear = np.linalg.norm(twist[:, :3], axis=1) > STILL_LINEAR
    return linear | (np.linalg.norm(twist[:, 3:], axis=1) > STILL_ANGULAR)


def _felt_control(pushed: Array, direct: Array, executed: Array) -> float:
    """Σ |u| cos(D(u), executed) / Σ |u|, over the part of the twist that D(u) commands."""
    commanded = _commanded_part(direct, executed)
    norms = np.linalg.norm(direct, axis=1) * np.linalg.norm(commanded, axis=1)
    products = np.einsum("ij,ij->i", direct, commanded)
    cosines = np.divide(products, norms, out=np.zeros_like(norms), where=norms > 1e-12)
    weights = np.where(np.any(direct != 0.0, axis=1), pushed, 0.0)
    total = weights.sum()
    return float(weights @ cosines / total) if total > 0.0 else float("nan")


def _commanded_part(direct: Array, executed: Array) -> Array:
    """The executed twist without the half (velocity or rotation) that the user does not command."""
    linear = np.any(direct[:, :3] != 0.0, axis=1, keepdims=True)
    angular = np.any(direct[:, 3:] != 0.0, axis=1, keepdims=True)
    return np.hstack([executed[:, :3] * linear, executed[:, 3:] * angular])


def _wrong_way(pushed: Array, direct: Array, executed: Array, dt: float) -> float:
    """∫ max(0, −v · û) dt while the user commands a velocity [m]; NaN without a push."""
    if not (pushed > 0.0).any():
        return float("nan")
    speeds = np.linalg.norm(direct[:, :3], axis=1)
    along = np.einsum("ij,ij->i", direct[:, :3], executed[:, :3])
    along = np.divide(along, speeds, out=np.zeros_like(along), where=speeds > 0.0)
    return float(np.maximum(0.0, -along[pushed > 0.0]).sum() * dt)


def _cancel_time(pushed: Array, direct: Array, executed: Array, dt: float) -> float:
    """Mean length of the runs of opposed ticks that end while the push goes on [s]."""
    pushing = pushed > 0.0
    against = pushing & (np.einsum("ij,ij->i", direct, executed) < 0.0)
    edges = np.diff(np.concatenate([[0], against.astype(int), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    inside = ends < len(pushing)
    starts, ends = starts[inside], ends[inside]
    cancelled = pushing[ends]
    lengths = (ends - starts)[cancelled]
    return float(lengths.mean() * dt) if len(lengths) else float("nan")


def _measure_belief(belief: Array, true_goal: int | None, dt: float) -> dict[str, float]:
    nan = float("nan")
    if not belief.size:
        return {"correct_s": nan, "wrong_confident_s": nan, "log_loss": nan, "brier": nan}
    wrong = belief if true_goal is None else np.delete(belief, true_goal, axis=1)
    confident = float((wrong >= CONFIDENT).any(axis=1).sum()) * dt
    if true_goal is None:
        return {"correct_s": nan, "wrong_confident_s": confident, "log_loss": nan, "brier": nan}
    p_true = belief[:, true_goal]
    rival = wrong.max(axis=1) if wrong.shape[1] else np.zeros(len(belief))
    behind = np.flatnonzero(p_true <= rival + 1e-9)  # a tie is not a lead
    first = 0 if not len(behind) else int(behind[-1]) + 1
    return {
        "correct_s": first * dt if first < len(belief) else nan,
        "wrong_confident_s": confident,
        "log_loss": float(-np.log(np.maximum(p_true, 1e-12)).mean()),
        "brier": float(((1.0 - p_true) ** 2 + (wrong**2).sum(axis=1)).mean()),
    }
