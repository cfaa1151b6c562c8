"""What the paper did not measure: feel of control, inference, learning, link; exploratory."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from app.analysis.design import make_cells, order_methods
from app.analysis.frames import Frame, pd
from app.analysis.hypotheses import adjust
from app.analysis.paired import Difference, Ranks, compare, signed_rank
from app.core.types import Array

_welch: Any = stats.ttest_ind

EXPLORED: dict[str, str] = {
    "felt_control": "felt control (mean cosine)",
    "opposed": "opposed (share of pushing)",
    "idle_motion": "idle motion (share of moving)",
    "wrong_way_m": "wrong-way motion [m]",
    "cancel_s": "cancel time [s]",
    "correct_s": "time to correct inference [s]",
    "wrong_confident_s": "confident of a wrong goal [s]",
    "log_loss": "log-loss of the belief [nat]",
    "brier": "Brier score of the belief",
}


@dataclass(frozen=True)
class Explored:
    """One further measure between the two methods of the hypotheses.

    Attributes:
        measure: Column.
        label: What the report calls it.
        means: Method → (mean, SD, n) over participants' means, every method.
        difference: Reference minus method; None with fewer than two methods.
        ranks: The signed-rank test of the same differences.
        adjusted: Benjamini–Hochberg over the explored measures.
        undefined: Counted trials in which the measure is undefined.
    """

    measure: str
    label: str
    means: dict[str, tuple[float, float, int]]
    difference: Difference | None
    ranks: Ranks | None
    adjusted: float
    undefined: int


def explore(trials: Frame, contrast: tuple[str, str] | None) -> list[Explored]:
    """Every further measure that the table holds."""
    found: list[Explored] = []
    counted = trials[trials["counted"]]
    for measure, label in EXPLORED.items():
        if counted[measure].isna().all():
            continue
        difference = ranks = None
        if contrast is not None:
            cells = make_cells(trials, measure)
            if set(contrast) <= set(cells.methods):
                _, means = cells.of_methods(*contrast).balanced_means()
                values = means[:, 0] - means[:, 1]
                difference, ranks = compare(values), signed_rank(values)
        undefined = int(counted[measure].isna().sum())
        found.append(
            Explored(
                measure,
                label,
                method_means(trials, measure),
                difference,
                ranks,
                float("nan"),
                undefined,
            )
        )
    adjusted = adjust({e.measure: e.ranks.p for e in found if e.ranks is not None})
    return [
        Explored(**{**vars(e), "adjusted": adjusted.get(e.measure, float("nan"))}) for e in found
    ]


def method_means(trials: Frame, measure: str) -> dict[str, tuple[float, float, int]]:
    """Mean, SD and number of participants' means per method (each trial of theirs weighs alike)."""
    rows = trials[trials["counted"]].dropna(subset=[measure])
    per_person = rows.groupby(["method", "participant_id"])[measure].mean()
    result: dict[str, tuple[float, float, int]] = {}
    for method in order_methods(set(rows["method"])):
        values: Array = per_person[method].to_numpy(dtype=float)
        sd = float(values.std(ddof=1)) if len(values) > 1 else float("nan")
        result[method] = (float(values.mean()), sd, len(values))
    return result


@dataclass(frozen=True)
class Trend:
    """Learning with one method: change of time per further trial, over participants.

    Attributes:
        method: Which method.
        slope: Mean over participants of the slope of time against trial number, objects' means
            removed [s per trial].
        low: Lower end of its 95 % interval.
        high: Upper end.
        p: Two-sided p of a one-sample t-test; NaN with fewer than two participants.
        n: Participants with at least two trials.
    """

    method: str
    slope: float
    low: float
    high: float
    p: float
    n: int


def number_trials(trials: Frame) -> Frame:
    """Counted trials with `nth`: which of the participant's trials with this method, from 1."""
    rows = trials[trials["counted"]].dropna(subset=["time_s"])
    rows = rows.sort_values(["participant_id", "method", "trial"], kind="stable")
    return rows.assign(nth=rows.groupby(["participant_id", "method"]).cumcount() + 1)


def find_trends(trials: Frame) -> list[Trend]:
    """How time changes from trial to trial within each method."""
    rows = number_trials(trials)
    easier = rows.groupby(["method", "object"])["time_s"].transform("mean")
    rows = rows.assign(y=rows["time_s"] - easier)
    groups = rows.groupby(["method", "participant_id"])
    x = rows["nth"] - groups["nth"].transform("mean")
    y = rows["y"] - groups["y"].transform("mean")
    sums = (
        pd.DataFrame({"xy": x * y, "xx": x * x})
        .groupby([rows["method"], rows["participant_id"]])
        .sum()
    )
    sums = sums[sums["xx"] > 0]
    slopes = (sums["xy"] / sums["xx"]).rename("slope").reset_index()
    trends = []
    for method in order_methods(set(slopes["method"])):
        values = slopes.loc[slopes["method"] == method, "slope"].to_numpy(dtype=float)
        d = compare(values)
        trends.append(Trend(method, d.mean, d.low, d.high, d.p, d.n))
    return trends


@dataclass(frozen=True)
class Carryover:
    """Does the difference depend on which method came first?

    Attributes:
        first: Which method came first → (mean difference reference − method [s], participants).
        p: Welch's t between the two groups; NaN where a group has fewer than two.
    """

    first: dict[str, tuple[float, int]]
    p: float


def find_carryover(trials: Frame, contrast: tuple[str, str]) -> Carryover | None:
    """Compare the time differences of those who began with one and with the other method."""
    rows = trials[trials["counted"]].dropna(subset=["method_position", "time_s"])
    positions = rows.pivot_table(
        index="participant_id", columns="method", values="method_position", aggfunc="min"
    )
    cells = make_cells(trials, "time_s")
    if not set(contrast) <= set(positions.columns) or not set(contrast) <= set(cells.methods):
        return None
    participants, means = cells.of_methods(*contrast).balanced_means()
    differences = pd.Series(means[:, 0] - means[:, 1], index=list(participants))
    first: dict[str, tuple[float, int]] = {}
    groups: list[Array] = []
    for method, other in (contrast, contrast[::-1]):
        began = positions.index[positions[method] < positions[other]]
        values = differences[differences.index.isin(began)].to_numpy(dtype=float)
        groups.append(values)
        first[method] = (float(values.mean()) if len(values) else float("nan"), len(values))
    if min(map(len, groups)) < 2 or all(np.ptp(g) == 0 for g in groups):
        return Carryover(first, float("nan")) if any(map(len, groups)) else None
    return Carryover(first, float(_welch(*groups, equal_var=False).pvalue))


@dataclass(frozen=True)
class Link:
    """Correlation of a quality of link or loop with a measure, within participant and method.

    Attributes:
        quality: "round_trip_ms", "late_share", "blurs" or "drops".
        measure: "time_s" or "input_s".
        r: Repeated-measures correlation (Bakdash & Marusich 2017).
        df: Its degrees of freedom.
        p: Two-sided p.
        n_trials: Trials that entered.
    """

    quality: str
    measure: str
    r: float
    df: int
    p: float
    n_trials: int


def find_links(trials: Frame) -> list[Link]:
    """Every quality against time and input, where the quality varies."""
    found = []
    for quality in ("round_trip_ms", "late_share", "blurs", "drops"):
        for measure in ("time_s", "input_s"):
            link = _correlate(trials[trials["counted"]], quality, measure)
            if link is not None:
                found.append(link)
    return found


def _correlate(rows: Frame, quality: str, measure: str) -> Link | None:
    rows = rows.dropna(subset=[quality, measure])
    keys = [rows["participant_id"], rows["method"]]
    sizes = rows.groupby(keys)[measure].transform("size")
    rows = rows[sizes >= 2]
    keys = [rows["participant_id"], rows["method"]]
    x = (rows[quality] - rows.groupby(keys)[quality].transform("mean")).to_numpy(dtype=float)
    y = (rows[measure] - rows.groupby(keys)[measure].transform("mean")).to_numpy(dtype=float)
    df = len(rows) - rows.groupby(keys).ngroups - 1
    scale = float((x @ x) * (y @ y)) ** 0.5
    if df < 1 or scale <= 1e-12:
        return None
    r = float(np.clip((x @ y) / scale, -1.0, 1.0))
    t = r * (df / max(1.0 - r * r, 1e-300)) ** 0.5
    return Link(quality, measure, r, df, float(2 * stats.t.sf(abs(t), df)), len(rows))
