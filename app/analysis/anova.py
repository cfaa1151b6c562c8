"""Repeated-measures analysis of variance: pingouin's, checked against two others each time.

The sums of squares are also written out here, because epsilon, Mauchly's test and generalised eta²
need them for every effect and number of levels, and because an answer that two libraries and a page
of arithmetic share is one to rely on. Sources: Winer (1971) for the partition, Greenhouse & Geisser
(1959) for ε, Bakeman (2005) for generalised eta².
"""

import warnings
from dataclasses import dataclass

import numpy as np
import pingouin
from scipy import stats
from statsmodels.stats.anova import AnovaRM

from app.analysis.design import Cells
from app.analysis.frames import Frame, pd
from app.core.types import Array

ANOVA_RM_LIMIT = 600
"""Observations above which statsmodels' AnovaRM is left out: its dense design matrix with every
subject × factor column needs minutes and gigabytes there."""


@dataclass(frozen=True)
class Effect:
    """One row of an ANOVA table.

    Attributes:
        source: "method", "object" or "method × object".
        df1: Degrees of freedom of the effect.
        df2: Degrees of freedom of its error.
        f: F ratio; NaN where the error has no variance.
        p: Uncorrected p.
        epsilon: Greenhouse–Geisser ε; 1 where the effect has one degree of freedom.
        p_corrected: p with both degrees of freedom times ε.
        mauchly_p: p of Mauchly's test of sphericity; NaN with one degree of freedom or too few
            participants.
        partial_eta2: SS / (SS + SS of its error).
        generalised_eta2: SS / (SS + SS of participants and of every error term).
    """

    source: str
    df1: int
    df2: int
    f: float
    p: float
    epsilon: float
    p_corrected: float
    mauchly_p: float
    partial_eta2: float
    generalised_eta2: float


@dataclass(frozen=True)
class Anova:
    """One analysis with what it left out.

    Attributes:
        measure: Column analysed.
        factors: "method × object", or "method".
        n: Participants that entered.
        dropped: Those who lacked a cell.
        effects: The table.
        agreement: Largest relative difference of F among the implementations.
        checked_with: Names of the implementations that agreed.
    """

    measure: str
    factors: str
    n: int
    dropped: tuple[str, ...]
    effects: tuple[Effect, ...]
    agreement: float
    checked_with: tuple[str, ...]

    def effect(self, source: str) -> Effect:
        """The row of a source."""
        return next(e for e in self.effects if e.source == source)


def two_way(cells: Cells) -> Anova:
    """Method × object over the participants whose cells are all there.

    Raises:
        ValueError: With fewer than two participants, methods or objects.
    """
    complete = cells.complete()
    dropped = tuple(p for p in cells.participants if p not in set(complete.participants))
    return _analyse(cells.measure, complete.means, ("method", "object"), dropped)


def one_way(cells: Cells) -> Anova:
    """Method alone, over participants' means across the objects they did with every method."""
    participants, means = cells.balanced_means()
    dropped = tuple(p for p in cells.participants if p not in set(participants))
    return _analyse(cells.measure, means[:, :, None], ("method",), dropped)


def _analyse(
    measure: str, values: Array, factors: tuple[str, ...], dropped: tuple[str, ...]
) -> Anova:
    n, *levels = values.shape
    if n < 2 or min(levels[: len(factors)]) < 2:
        raise ValueError(f"{n} participants with {levels} levels: too few for an ANOVA")
    written = write_out(values, factors)
    ours = np.array([e.f for e in written])
    tables = {"sums of squares written out": ours}
    worst = float("nan")
    if np.isfinite(ours).all():
        long, within = _to_long(values), ["first", "second"][: len(factors)]
        if n > 2:  # with two, pingouin's test of sphericity divides by zero
            tables["pingouin"] = _by_pingouin(long, within)
        if values.size <= ANOVA_RM_LIMIT:
            tables["statsmodels"] = _by_statsmodels(long, within)
        scale = np.maximum(np.abs(ours), 1e-9)
        worst = max(float(np.max(np.abs(f - ours) / scale)) for f in tables.values())
    return Anova(measure, " × ".join(factors), n, dropped, written, worst, tuple(tables))


def write_out(values: Array, factors: tuple[str, ...]) -> tuple[Effect, ...]:
    """The table by sums of squares of orthonormal contrasts.

    For an effect with contrast matrix C (rows orthonormal, one per degree of freedom) and each
    participant's cell vector y: z = C y; SS = n |mean z|², its error Σ |z − mean z|².

    Args:
        values: Cell values, shape (n, n_methods, n_objects); n_objects may be 1.
        factors: Names of the first one or two axes.
    """
    n, a, b = values.shape
    flat = values.reshape(n, a * b)
    mean_a, mean_b = np.full((1, a), a**-0.5), np.full((1, b), b**-0.5)
    contrasts = {factors[0]: np.kron(_helmert(a), mean_b)}
    if len(factors) == 2:
        contrasts[factors[1]] = np.kron(mean_a, _helmert(b))
        contrasts[" × ".join(factors)] = np.kron(_helmert(a), _helmert(b))
    scores = {source: flat @ c.T for source, c in contrasts.items()}
    errors = {source: float(((z - z.mean(0)) ** 2).sum()) for source, z in scores.items()}
    subjects = (flat @ np.kron(mean_a, mean_b).T)[:, 0]
    residual = float(((subjects - subjects.mean()) ** 2).sum()) + sum(errors.values())
    floor = 1e-24 * float((flat**2).sum())  # what rounding leaves of equal differences
    return tuple(
        _effect(source, scores[source], errors[source], residual, floor) for source in contrasts
    )


def _effect(source: str, scores: Array, error: float, residual: float, floor: float) -> Effect:
    n, df = scores.shape
    square = float(n * (scores.mean(0) ** 2).sum())
    df2 = df * (n - 1)
    nan = float("nan")
    if error <= floor:
        return Effect(source, df, df2, nan, nan, nan, nan, nan, nan, nan)
    f = (square / df) / (error / df2)
    covariance = np.atleast_2d(np.cov(scores.T))
    trace = float(np.trace(covariance))
    epsilon = 1.0 if df == 1 else trace**2 / (df * float((covariance**2).sum()))
    return Effect(
        source=source,
        df1=df,
        df2=df2,
        f=f,
        p=float(stats.f.sf(f, df, df2)),
        epsilon=epsilon,
        p_corrected=float(stats.f.sf(f, df * epsilon, df2 * epsilon)),
        mauchly_p=_mauchly(covariance, n),
        partial_eta2=square / (square + error),
        generalised_eta2=square / (square + residual),
    )


def _mauchly(covariance: Array, n: int) -> float:
    """P of Mauchly's test, by a χ² series; NaN where it does not exist."""
    df = len(covariance)
    if df < 2 or n - 1 < df:
        return float("nan")
    sign, log_det = np.linalg.slogdet(covariance)
    if sign <= 0:
        return float("nan")
    log_w = log_det - df * np.log(np.trace(covariance) / df)
    scale = 1.0 - (2 * df**2 + df + 2) / (6 * df * (n - 1))
    # Second-order term of the series for the distribution of W (Anderson 2003, 10.7.4).
    second = (df + 2) * (df - 1) * (df - 2) * (2 * df**3 + 6 * df**2 + 3 * df + 2)
    second /= 288 * (df * (n - 1) * scale) ** 2
    chi2, chi2_df = -(n - 1) * scale * log_w, df * (df + 1) // 2 - 1
    first = float(stats.chi2.sf(chi2, chi2_df))
    return first + second * (float(stats.chi2.sf(chi2, chi2_df + 4)) - first)


def _helmert(k: int) -> Array:
    """Orthonormal contrasts among k levels, shape (k − 1, k)."""
    rows = np.zeros((k - 1, k))
    for i in range(1, k):
        rows[i - 1, :i], rows[i - 1, i] = 1.0, -i
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def _to_long(values: Array) -> Frame:
    n, a, b = values.shape
    participant, first, second = np.indices((n, a, b)).reshape(3, -1)
    return pd.DataFrame(
        {"participant": participant, "first": first, "second": second, "value": values.ravel()}
    )


def _by_pingouin(long: Frame, within: list[str]) -> Array:
    """F of each effect, in the order first, second, interaction."""
    with warnings.catch_warnings():
        # pingouin 0.7 still passes `inplace`, which pandas 3.1 announces to remove.
        warnings.filterwarnings("ignore", category=pd.errors.Pandas4Warning)
        table = pingouin.rm_anova(
            long, dv="value", within=within, subject="participant", detailed=True
        )
    return table.loc[table["Source"] != "Error", "F"].to_numpy(dtype=float)


def _by_statsmodels(long: Frame, within: list[str]) -> Array:
    """F of each effect, in the order first, second, interaction."""
    table = AnovaRM(long, "value", "participant", within=within).fit().anova_table
    return table["F Value"].to_numpy(dtype=float)
