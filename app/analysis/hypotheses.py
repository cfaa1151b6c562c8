"""H1–H3 of the paper: the tests, the correction over them, and the answers in words."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from app.analysis.anova import Anova, one_way, two_way
from app.analysis.design import make_cells
from app.analysis.frames import Frame, pd
from app.analysis.paired import Difference, Ranks, Ratio, compare, ratio_of_means, signed_rank
from app.core.types import Array

ALPHA = 0.05
NEUTRAL = 4.0
"""The middle of the 1–7 preference."""


@dataclass(frozen=True)
class MethodTest:
    """Time or input: reference against method.

    Attributes:
        measure: "time_s" or "input_s".
        anova: Analysis whose method effect is the test; None where there are too few participants.
        difference: Reference minus method over participants' means.
        ratio: Reference / method of the same means.
        means: Mean of reference and of method over those participants.
        note: Why this analysis, in a sentence; empty where it is the paper's.
    """

    measure: str
    anova: Anova | None
    difference: Difference
    ratio: Ratio
    means: tuple[float, float]
    note: str

    @property
    def p(self) -> float:
        """P of the method effect; NaN without a test."""
        return self.anova.effect("method").p if self.anova else float("nan")

    @property
    def in_favour(self) -> bool:
        """Whether the method's mean is the smaller one."""
        return self.means[1] < self.means[0]


@dataclass(frozen=True)
class SurveyTest:
    """The two tests of H3.

    Attributes:
        like: Reference minus method of the item `like`.
        prefer: The item `prefer` minus 4; above 0 favours the method.
        like_dropped: Participants who answered `like` for one method only.
    """

    like: Ranks
    prefer: Ranks
    prefer_mean: float
    prefer_sd: float
    like_dropped: tuple[str, ...]


@dataclass(frozen=True)
class Verdict:
    """One hypothesis, answered.

    Attributes:
        name: "H1", "H2", "H3".
        claim: The paper's sentence with this study's methods.
        answer: "supported", "not supported", "contradicted" or "not tested".
        words: The numbers behind it, in one or two sentences.
    """

    name: str
    claim: str
    answer: str
    words: str


@dataclass(frozen=True)
class Hypotheses:
    """Tests, adjusted p-values by name, verdicts."""

    contrast: tuple[str, str]
    time: MethodTest
    input: MethodTest
    survey: SurveyTest
    adjusted: dict[str, float]
    verdicts: tuple[Verdict, ...]


def adjust(p_values: dict[str, float]) -> dict[str, float]:
    """Benjamini–Hochberg over the tests that exist; those without a p stay NaN."""
    known = {name: p for name, p in p_values.items() if np.isfinite(p)}
    adjusted = stats.false_discovery_control(list(known.values())) if known else []
    return {n: float("nan") for n in p_values} | dict(zip(known, map(float, adjusted), strict=True))


def compare_methods(trials: Frame, measure: str, contrast: tuple[str, str]) -> MethodTest:
    """The paper's two-factor ANOVA; one factor where too few participants have every cell."""
    cells = make_cells(trials, measure).of_methods(*contrast)
    _, means = cells.balanced_means()
    complete = cells.complete()
    anova, note = None, ""
    if len(means) < 2:
        note = f"{len(means)} participants have both methods on a shared object: no test."
    elif (
        len(cells.objects) >= 2
        and len(complete.participants) >= 2
        and 2 * len(complete.participants) >= len(means)
    ):
        anova = two_way(cells)
        _, means = complete.balanced_means()  # the effect is of those whom the test is of
    else:
        anova = one_way(cells)
        note = (
            "There is one object only: one-factor ANOVA."
            if len(cells.objects) < 2
            else f"Only {len(complete.participants)} of {len(means)} participants have a value in "
            "every cell of method × object: one-factor ANOVA over each participant's means "
            "across the objects done with both methods."
        )
    mean = tuple(map(float, means.mean(0))) if len(means) else (float("nan"),) * 2
    return MethodTest(
        measure,
        anova,
        compare(means[:, 0] - means[:, 1]),
        ratio_of_means(means[:, 0], means[:, 1]),
        (mean[0], mean[1]),
        note,
    )


def answers(survey: Frame, item: str) -> Frame:
    """Answers to an item: participants × methods, the mean where someone answered repeatedly."""
    rows = survey[survey["item"] == item]
    return rows.pivot_table(index="participant_id", columns="method", values="value")


def compare_answers(survey: Frame, contrast: tuple[str, str]) -> SurveyTest:
    """Signed-rank tests of `like` between the methods and of `prefer` against neutral."""
    table = answers(survey, "like").reindex(columns=pd.Index(contrast))
    both = table.dropna()
    prefer = survey[survey["item"] == "prefer"].groupby("participant_id")["value"].mean()
    values: Array = prefer.to_numpy(dtype=float)
    return SurveyTest(
        signed_rank((both[contrast[0]] - both[contrast[1]]).to_numpy(dtype=float)),
        signed_rank(values - NEUTRAL),
        float(values.mean()) if len(values) else float("nan"),
        float(values.std(ddof=1)) if len(values) > 1 else float("nan"),
        tuple(map(str, table.index.difference(both.index))),
    )


def answer_hypotheses(trials: Frame, survey: Frame, contrast: tuple[str, str]) -> Hypotheses:
    """All tests, Benjamini–Hochberg over the four of them, and the answers."""
    reference, method = contrast
    time = compare_methods(trials, "time_s", contrast)
    effort = compare_methods(trials, "input_s", contrast)
    opinion = compare_answers(survey, contrast)
    p_values = {
        "time": time.p,
        "input": effort.p,
        "like": opinion.like.p,
        "prefer": opinion.prefer.p,
    }
    adjusted = adjust(p_values)
    claims = (
        f"Participants using {method} grasp objects faster than with {reference}.",
        f"Participants using {method} grasp objects with less input than with {reference}.",
        f"Participants prefer {method} to {reference}.",
    )
    return Hypotheses(
        contrast,
        time,
        effort,
        opinion,
        adjusted,
        (
            _judge_measure("H1", claims[0], time, adjusted["time"], contrast),
            _judge_measure("H2", claims[1], effort, adjusted["input"], contrast),
            _judge_opinion("H3", claims[2], opinion, adjusted, contrast),
        ),
    )


def format_p(p: float) -> str:
    """A p-value for a sentence: three digits, or "< .001"."""
    if not np.isfinite(p):
        return "undefined"
    # No-break spaces: "p <" alone at the end of a line reads badly.
    return "<\N{NO-BREAK SPACE}.001" if p < 0.001 else f"=\N{NO-BREAK SPACE}{drop_zero(p)}"


def drop_zero(p: float) -> str:
    """Three digits, without the zero that no p needs."""
    return f"{p:.3f}".removeprefix("0")


def _judge_measure(
    name: str, claim: str, test: MethodTest, adjusted: float, contrast: tuple[str, str]
) -> Verdict:
    if test.anova is None or not np.isfinite(test.p):
        why = test.note or "The differences between participants do not vary: no F exists."
        return Verdict(name, claim, "not tested", why)
    effect = test.anova.effect("method")
    d = test.difference
    answer = "not supported"
    if adjusted < ALPHA:
        answer = "supported" if test.in_favour else "contradicted"
    words = (
        f"{contrast[0]} {test.means[0]:.2f} s, {contrast[1]} {test.means[1]:.2f} s "
        f"(ratio {test.ratio.estimate:.2f}); F({effect.df1}, {effect.df2}) = {effect.f:.2f}, "
        f"p {format_p(effect.p)}, adjusted p {format_p(adjusted)}, dz = {d.dz:.2f}, "
        f"n = {test.anova.n}."
    )
    if test.anova.dropped:
        words += f" {len(test.anova.dropped)} left out for a missing cell."
    return Verdict(name, claim, answer, f"{words} {test.note}".strip())


def _judge_opinion(
    name: str,
    claim: str,
    test: SurveyTest,
    adjusted: dict[str, float],
    contrast: tuple[str, str],
) -> Verdict:
    if not (np.isfinite(test.like.p) or np.isfinite(test.prefer.p)):
        why = "There are no survey answers." if not test.like.n + test.prefer.n else test.like.note
        return Verdict(name, claim, "not tested", why or test.prefer.note)
    # `like` is reference minus method, `prefer` grows towards the method.
    leans = {"like": -test.like.lean, "prefer": test.prefer.lean}
    clear = {leans[item] for item in leans if adjusted[item] < ALPHA}
    answer = {frozenset([1]): "supported", frozenset([-1]): "contradicted"}.get(
        frozenset(clear), "not supported"
    )
    parts = []
    for item, ranks in (("like", test.like), ("prefer", test.prefer)):
        if np.isfinite(ranks.p):
            parts.append(
                f"{item}: W = {ranks.w:g}, n = {ranks.n}, p {format_p(ranks.p)}, "
                f"adjusted p {format_p(adjusted[item])}"
            )
        else:
            parts.append(f"{item}: {ranks.note}")
    words = "; ".join(parts) + "."
    if np.isfinite(test.prefer_mean):
        toward = contrast[1] if test.prefer_mean > NEUTRAL else contrast[0]
        lean = "neutral" if test.prefer_mean == NEUTRAL else f"towards {toward}"
        words += f" Mean preference {test.prefer_mean:.2f} (4 is neutral): {lean}."
    return Verdict(name, claim, answer, words)
