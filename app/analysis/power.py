"""How many participants a paired design needs: from an effect given, measured or simulated.

The safeguard: a measured dz overestimates as often as not, so plan with the lower end of its 60 %
interval (Perugini, Gallucci & Costantini 2014) and read the measured one as the best case.
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from app.analysis.errors import AnalysisError
from app.analysis.numbers import number
from app.analysis.paired import compare, dz_interval
from app.core.types import Array

SAFEGUARD = 0.6
"""Confidence of the interval whose lower end is planned with."""

LIMIT = 100_000
"""Participants beyond which the answer is "not with this design"."""


def power_of(dz: float, n: int, alpha: float = 0.05) -> float:
    """Power of a two-sided paired t-test, by the noncentral t."""
    if n < 2:
        return 0.0
    critical = float(stats.t.ppf(1 - alpha / 2, n - 1))
    shift = abs(dz) * n**0.5
    if shift > 35.0:  # beyond, the noncentral t underflows; the power is 1 to all digits
        return 1.0
    upper = float(stats.nct.sf(critical, n - 1, shift))
    return min(1.0, upper + float(stats.nct.cdf(-critical, n - 1, shift)))


def required_participants(dz: float, power: float = 0.8, alpha: float = 0.05) -> int | None:
    """Smallest n whose power is reached; None where 100 000 do not suffice.

    Raises:
        AnalysisError: If a value lies outside its range.
    """
    if not 0.0 < power < 1.0 or not 0.0 < alpha < 1.0:
        raise AnalysisError(f"power {power} and alpha {alpha} must lie between 0 and 1")
    if not np.isfinite(dz) or dz == 0.0:
        raise AnalysisError(f"an effect of dz = {dz} needs no number of participants: it is none")
    low, high = 1, 2
    while power_of(dz, high, alpha) < power:
        low, high = high, 2 * high
        if high > LIMIT:
            return None
    while high - low > 1:  # power grows with n
        middle = (low + high) // 2
        low, high = (low, middle) if power_of(dz, middle, alpha) >= power else (middle, high)
    return high


def safeguard_effect(dz: float, n: int, confidence: float = SAFEGUARD) -> float:
    """The end towards 0 of the interval of dz; 0 where the interval holds 0."""
    low, high = dz_interval(abs(dz), n, confidence)
    return max(0.0, low) if high > 0.0 else 0.0


@dataclass(frozen=True)
class PowerPlan:
    """What `hindsight simulate power` answers for one measure.

    Attributes:
        label: What is tested, e.g. "time: blend − policy".
        dz: The effect planned for.
        n_observed: Participants it was measured on; 0 where it was given.
        safeguard: Lower end of its 60 % interval; NaN where it was given.
        needed: Power → participants for dz; None where none suffice.
        needed_safeguard: Power → participants for the safeguard.
        simulated: n → share of resampled studies that were significant; empty without data.
    """

    label: str
    dz: float
    n_observed: int
    safeguard: float
    needed: dict[float, int | None]
    needed_safeguard: dict[float, int | None]
    simulated: dict[int, float]


def plan_for_effect(
    dz: float,
    *,
    n_observed: int = 0,
    label: str = "effect",
    powers: tuple[float, ...] = (0.8, 0.9),
    alpha: float = 0.05,
) -> PowerPlan:
    """Plan for a dz that is given, or that was measured on n_observed participants."""
    needed = {power: required_participants(dz, power, alpha) for power in powers}
    safeguard = safeguard_effect(dz, n_observed) if n_observed >= 2 else float("nan")
    safe: dict[float, int | None] = {}
    if n_observed >= 2:
        safe = {
            power: required_participants(safeguard, power, alpha) if safeguard > 0.0 else None
            for power in powers
        }
    return PowerPlan(label, dz, n_observed, safeguard, needed, safe, {})


def plan_for_differences(
    differences: Array,
    *,
    label: str,
    powers: tuple[float, ...] = (0.8, 0.9),
    alpha: float = 0.05,
    seed: int = 0,
) -> PowerPlan:
    """Plan from participants' differences, measured or simulated.

    Beside the formula, studies of each size are drawn from the differences themselves, which shows
    what their skew and outliers do to the test.

    Raises:
        AnalysisError: If there are fewer than three differences, or they do not vary.
    """
    found = compare(differences)
    if found.n < 3 or not np.isfinite(found.dz):
        raise AnalysisError(
            f"{label}: {found.n} differences that vary are needed, at least 3; got {found.n}"
        )
    plan = plan_for_effect(found.dz, n_observed=found.n, label=label, powers=powers, alpha=alpha)
    top = max([n for n in plan.needed.values() if n is not None], default=48)
    sizes = sorted({max(3, round(top * share)) for share in (0.5, 0.75, 1.0, 1.25, 1.5, 2.0)})
    simulated = {n: resampled_power(differences, n, alpha, seed) for n in sizes if n <= 500}
    return PowerPlan(**{**vars(plan), "simulated": simulated})


def resampled_power(
    differences: Array, n: int, alpha: float = 0.05, seed: int = 0, draws: int = 4000
) -> float:
    """Share of studies of n participants, drawn from the differences, with p < alpha."""
    picks = np.random.default_rng([seed, n]).integers(0, len(differences), size=(draws, n))
    samples = np.asarray(differences, dtype=float)[picks]
    spread = samples.std(axis=1, ddof=1)
    varies = spread > 0.0
    t = np.where(varies, samples.mean(1) * n**0.5 / np.where(varies, spread, 1.0), np.inf)
    return float(np.mean(np.abs(t) > stats.t.ppf(1 - alpha / 2, n - 1)))


def format_plan(plan: PowerPlan) -> str:
    """The plan as a few lines of text."""

    def sizes(needed: dict[float, int | None]) -> str:
        return ", ".join(
            f"{n if n is not None else 'no number of'} for {100 * power:g} %"
            for power, n in needed.items()
        )

    lines = [f"{plan.label}: dz = {number(plan.dz)}: participants {sizes(plan.needed)}"]
    if plan.needed_safeguard:
        lines.append(
            f"  safeguard (lower end of the 60 % interval, n = {plan.n_observed}): "
            f"dz = {number(plan.safeguard)}: participants {sizes(plan.needed_safeguard)}"
        )
    if plan.simulated:
        shares = ", ".join(f"{n}: {100 * share:.0f} %" for n, share in plan.simulated.items())
        lines.append(f"  power in studies drawn from the data: {shares}")
    return "\n".join(lines)
