"""Two methods on the same participants: difference, effect size, ratio, ranks.

Sources: dz and its interval by the noncentral t (Cumming & Finch 2001); Wilcoxon (1945).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import optimize, stats

from app.core.types import Array

_wilcoxon: Any = stats.wilcoxon
_root: Any = optimize.brentq

EXACT_LIMIT = 50
"""Non-zero differences up to which every sign pattern is counted; scipy's limit too."""


@dataclass(frozen=True)
class Difference:
    """Reference minus method over participants.

    Attributes:
        n: Participants with both.
        mean: Mean difference, in the measure's unit.
        low: Lower end of its 95 % interval.
        high: Upper end.
        dz: Mean / SD of the differences; NaN where they do not vary.
        dz_low: Lower end of the 95 % interval of dz.
        dz_high: Upper end.
        t: Paired t.
        p: Two-sided p of t.
    """

    n: int
    mean: float
    low: float
    high: float
    dz: float
    dz_low: float
    dz_high: float
    t: float
    p: float


def compare(differences: Array) -> Difference:
    """Summarise paired differences, shape (n,)."""
    n, nan = len(differences), float("nan")
    mean = float(np.mean(differences)) if n else nan
    sd = float(np.std(differences, ddof=1)) if n > 1 else nan
    if not sd > 1e-12 * max(1.0, abs(mean)):
        return Difference(n, mean, nan, nan, nan, nan, nan, nan, nan)
    half = float(stats.t.ppf(0.975, n - 1)) * sd / n**0.5
    dz = mean / sd
    low, high = dz_interval(dz, n, 0.95)
    t = dz * n**0.5
    p = float(2 * stats.t.sf(abs(t), n - 1))
    return Difference(n, mean, mean - half, mean + half, dz, low, high, t, p)


def dz_interval(dz: float, n: int, confidence: float) -> tuple[float, float]:
    """Two-sided interval of dz, by the noncentrality that puts t at its tail probabilities."""
    t, tail = dz * n**0.5, (1 - confidence) / 2

    def tail_below(delta: float) -> float:
        exact = float(stats.nct.cdf(t, n - 1, delta))
        if np.isfinite(exact):
            return exact
        # scipy's series breaks down far from t, where this normal form (Kraemer & Paik 1979) holds.
        spread = (1 + t**2 / (2 * (n - 1))) ** 0.5
        return float(stats.norm.cdf((t * (1 - 1 / (4 * (n - 1))) - delta) / spread))

    def solve(level: float) -> float:
        def miss(delta: float) -> float:
            return tail_below(delta) - level

        width = 4.0 + 2.0 * abs(t)
        return float(_root(miss, t - width, t + width)) / n**0.5

    # There the normal form is good to three digits, and scipy's noncentral t not to be trusted.
    if n > 200 or abs(t) > 35.0:
        half = float(stats.norm.ppf(1 - tail)) * (1 / n + dz**2 / (2 * n)) ** 0.5
        return dz - half, dz + half
    return solve(1 - tail), solve(tail)


@dataclass(frozen=True)
class Ranks:
    """A Wilcoxon signed-rank test with everything that decides its p.

    Attributes:
        n: Values given.
        zeros: Differences of exactly zero; zero_method "wilcox" leaves them out.
        ties: Non-zero differences that share their size with another.
        w_plus: Rank sum of the positive differences.
        w_minus: Rank sum of the negative ones.
        p: Two-sided p by `method`.
        method: "exact", "exact over sign patterns (ties)" or "normal approximation".
        p_asymptotic: Normal approximation with tie correction, without continuity correction: what
            scipy gave in 2015 and the paper printed.
        median: Median difference.
        note: Why there is no p; empty where there is one.
    """

    n: int
    zeros: int
    ties: int
    w_plus: float
    w_minus: float
    p: float
    method: str
    p_asymptotic: float
    median: float
    note: str = ""

    @property
    def w(self) -> float:
        """The smaller of the two rank sums."""
        return min(self.w_plus, self.w_minus)

    @property
    def lean(self) -> int:
        """1 where the ranks lean to positive differences, −1 to negative, 0 to neither."""
        return int(self.w_plus > self.w_minus) - int(self.w_plus < self.w_minus)


def signed_rank(differences: Array) -> Ranks:
    """Wilcoxon's signed-rank test of differences against 0, two-sided."""
    d = np.asarray(differences, dtype=float)
    nan = float("nan")
    nonzero = d[d != 0.0]
    zeros = len(d) - len(nonzero)
    median = float(np.median(d)) if len(d) else nan
    _, sizes = np.unique(np.abs(nonzero), return_counts=True)
    ties = int(sizes[sizes > 1].sum())
    if not len(nonzero):
        why = "every difference is zero" if len(d) else "nobody answered"
        return Ranks(len(d), zeros, 0, nan, nan, nan, "none", nan, median, why)
    asymptotic = _wilcoxon(nonzero, correction=False, method="asymptotic")
    total = len(nonzero) * (len(nonzero) + 1) / 2
    w_plus = float(stats.rankdata(np.abs(nonzero))[nonzero > 0].sum())
    if not ties and len(nonzero) <= EXACT_LIMIT:
        p, method = float(_wilcoxon(nonzero, method="exact").pvalue), "exact"
    elif len(nonzero) <= EXACT_LIMIT:
        p, method = exact_p(np.abs(nonzero), w_plus), "exact over sign patterns (ties)"
    else:
        p, method = float(asymptotic.pvalue), "normal approximation"
    asymptotic_p = float(asymptotic.pvalue)
    return Ranks(len(d), zeros, ties, w_plus, total - w_plus, p, method, asymptotic_p, median)


def exact_p(sizes: Array, w_plus: float) -> float:
    """Two-sided p of a rank sum, counting all 2ⁿ sign patterns; ties keep their mean ranks.

    The same as scipy's PermutationMethod, which stops at 13 differences and takes seconds there.

    Args:
        sizes: Absolute non-zero differences, shape (n,).
        w_plus: Observed rank sum of the positive ones.
    """
    doubled = np.rint(2 * stats.rankdata(sizes)).astype(int)  # mean ranks are halves
    patterns = np.zeros(int(doubled.sum()) + 1)
    patterns[0] = 1.0
    for rank in doubled:
        patterns[rank:] += patterns[:-rank].copy()
    patterns /= patterns.sum()
    observed = round(2 * w_plus)
    below, above = patterns[: observed + 1].sum(), patterns[observed:].sum()
    return float(min(1.0, 2 * min(below, above)))


@dataclass(frozen=True)
class Ratio:
    """Ratio of means with a bootstrap interval over participants."""

    n: int
    estimate: float
    low: float
    high: float


def ratio_of_means(reference: Array, method: Array, seed: int = 0, draws: int = 2000) -> Ratio:
    """Mean of reference / mean of method, participants resampled with both their values.

    Args:
        reference: Participants' means, shape (n,).
        method: The same participants' means, shape (n,).
        seed: Of the bootstrap; the same data give the same interval.
        draws: Bootstrap samples.
    """
    n, nan = len(reference), float("nan")
    if n == 0 or method.mean() <= 0.0:
        return Ratio(n, nan, nan, nan)
    estimate = float(reference.mean() / method.mean())
    if n < 2:
        return Ratio(n, estimate, nan, nan)
    picks = np.random.default_rng(seed).integers(0, n, size=(draws, n))
    above, below = reference[picks].mean(1), method[picks].mean(1)
    ratios = above[below > 0] / below[below > 0]
    low, high = np.percentile(ratios, [2.5, 97.5])
    return Ratio(n, estimate, float(low), float(high))
