"""The report's tables as rows of text; one function a table."""

from dataclasses import dataclass

from app.analysis.anova import Anova
from app.analysis.beyond import Carryover
from app.analysis.frames import Frame
from app.analysis.hypotheses import Hypotheses
from app.analysis.numbers import DASH, interval, mean_and_sd, number, p_value
from app.analysis.paired import Ranks
from app.analysis.results import Results

MEASURES = {"time_s": "time [s]", "input_s": "input [s]"}


@dataclass(frozen=True)
class Table:
    """A table of text: caption, headings, rows; the first `labels` columns are words."""

    caption: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    labels: int = 1
    tail: int = 0
    """Last columns that are words too."""
    note: str = ""


def exclusion_table(results: Results) -> Table | None:
    """Who was left out, why, by which rule."""
    if not results.exclusions:
        return None
    rows = tuple((e.participant_id, e.reason, e.rule) for e in results.exclusions)
    return Table("Participants left out", ("participant", "why", "rule"), rows, labels=3)


def outcome_rows(results: Results) -> Table:
    """Outcomes of all trials outside training, by method."""
    frame = results.outcomes
    kinds = [c for c in frame.columns if c not in ("method", "trials", "success", "counted")]
    kinds.sort(key=lambda kind: (kind != "grasped", kind))
    headings = ("method", "trials", "success", "counted", *(k.replace("_", " ") for k in kinds))
    rows = tuple(
        (
            str(r["method"]),
            str(int(r["trials"])),
            f"{100 * r['success']:.0f} %",
            str(int(r["counted"])),
            *(str(int(r[k])) for k in kinds),
        )
        for r in frame.to_dict("records")
    )
    return Table("Trials outside training, failed and repeated ones included", headings, rows)


def hypothesis_rows(h: Hypotheses) -> Table:
    """The four tests behind H1–H3."""
    reference, method = h.contrast
    rows = []
    for name, test in (("time", h.time), ("input", h.input)):
        d = test.difference
        if test.anova is None:
            rows.append((f"{name}: ANOVA", DASH, str(d.n), DASH, DASH, DASH, DASH))
            continue
        e = test.anova.effect("method")
        rows.append(
            (
                f"{name}: {test.anova.factors}",
                f"F({e.df1}, {e.df2}) = {number(e.f)}",
                str(test.anova.n),
                p_value(e.p),
                p_value(h.adjusted[name]),
                f"dz = {number(d.dz)} {interval(d.dz_low, d.dz_high)}",
                f"{number(test.ratio.estimate)} {interval(test.ratio.low, test.ratio.high)}",
            )
        )
    for name, ranks in (("like", h.survey.like), ("prefer against 4", h.survey.prefer)):
        adjusted = h.adjusted[name.split()[0]]
        rows.append((f"{name}: signed rank", *rank_cells(ranks), p_value(adjusted), DASH, DASH))
    return Table(
        f"Tests: {reference} against {method}",
        ("test", "statistic", "n", "p", "p adjusted", "effect, 95 %", "ratio of means, 95 %"),
        tuple(rows),
        labels=2,
    )


def rank_cells(ranks: Ranks) -> tuple[str, str, str]:
    """Statistic, n and p of a signed-rank test."""
    w = f"W = {ranks.w:g}" if not ranks.note else ranks.note
    return w, str(ranks.n), p_value(ranks.p)


def describe_ranks(name: str, ranks: Ranks) -> str:
    """How the p of a rank test came about: zeros, ties, method."""
    if ranks.note:
        return f"{name}: {ranks.note}."
    zeros = f"{ranks.zeros} of {ranks.n} differences are zero" + (
        " and left out (zero_method “wilcox”)" if ranks.zeros else ""
    )
    ties = f"{ranks.ties} are tied" if ranks.ties else "none are tied"
    return (
        f"{name}: {zeros}, {ties}; p {p_value(ranks.p)} ({ranks.method}); by the normal "
        f"approximation without continuity correction {p_value(ranks.p_asymptotic)}."
    )


def cell_rows(frame: Frame, measure: str) -> Table:
    """Means of a measure by method and object."""
    rows = tuple(
        (
            str(r["method"]),
            str(r["object"]),
            str(r["n"]),
            str(r["trials"]),
            *(number(r[k]) for k in ("mean", "sd", "se", "median")),
        )
        for r in frame.to_dict("records")
    )
    return Table(
        f"{MEASURES[measure].capitalize()} of counted trials",
        ("method", "object", "participants", "trials", "mean", "SD", "SE", "median"),
        rows,
        labels=2,
    )


def anova_rows(anova: Anova) -> Table:
    """An ANOVA table with corrections and effect sizes."""
    rows = tuple(
        (
            e.source,
            f"{e.df1}, {e.df2}",
            number(e.f),
            p_value(e.p),
            number(e.epsilon, 3),
            p_value(e.p_corrected),
            p_value(e.mauchly_p),
            number(e.partial_eta2, 3),
            number(e.generalised_eta2, 3),
        )
        for e in anova.effects
    )
    checked = ", ".join(anova.checked_with)
    note = f"n = {anova.n}."
    if anova.dropped:
        note += f" Left out for a missing cell: {len(anova.dropped)}."
    if len(anova.checked_with) > 1:
        digits = anova.agreement
        note += f" {checked} agree" + (
            " exactly." if digits == 0 else f" to {digits:.0e} of F.".replace("e-0", "e-")
        )
    return Table(
        f"{MEASURES.get(anova.measure, anova.measure)}: {anova.factors}".capitalize(),
        ("source", "df", "F", "p", "ε (GG)", "p corrected", "Mauchly p", "partial η²", "gen. η²"),
        rows,
        note=note,
    )


def pair_rows(results: Results) -> Table:
    """Every pair of methods in time and input."""
    rows = tuple(
        (
            MEASURES[p.measure],
            f"{p.reference} − {p.method}",
            str(p.difference.n),
            f"{number(p.difference.mean)} {interval(p.difference.low, p.difference.high)}",
            number(p.difference.dz),
            p_value(p.difference.p),
            p_value(p.adjusted),
            f"{number(p.ratio.estimate)} {interval(p.ratio.low, p.ratio.high)}",
        )
        for p in results.pairs
    )
    return Table(
        "Pairs of methods over participants' means on shared objects",
        ("measure", "pair", "n", "difference, 95 %", "dz", "p", "p adj.", "ratio, 95 %"),
        rows,
        labels=2,
        note="Paired t-tests; adjusted (Benjamini–Hochberg) over the pairs of a measure. "
        "Ratio: of means, interval by bootstrap over participants.",
    )


def mixed_rows(results: Results) -> Table:
    """The mixed models."""
    rows = tuple(
        (
            MEASURES[m.measure],
            str(m.n_participants),
            str(m.n_trials),
            f"{number(m.difference)} {interval(m.low, m.high)}",
            p_value(m.p),
            m.random,
            "; ".join(m.warnings) or "none",
        )
        for m in results.mixed
    )
    return Table(
        "Sensitivity: linear mixed model of every counted trial",
        ("measure", "participants", "trials", "difference, 95 %", "p", "random", "warnings"),
        rows,
        tail=2,
        note="A check only: with ten participants its test rejects a true null in 8.7 % of "
        "studies.",
    )


def survey_rows(results: Results) -> Table:
    """Means of the survey items, with the exploratory tests."""
    assert results.survey_means is not None
    tests = {t.item: t.ranks for t in results.items}
    rows = tuple(
        (
            str(r["item"]),
            str(r["method"]) or "(both)",
            str(r["n"]),
            number(r["mean"]),
            number(r["sd"]),
            number(r["se"]),
            p_value(tests[r["item"]].p) if r["item"] in tests else DASH,
        )
        for r in results.survey_means.to_dict("records")
    )
    return Table(
        "Survey",
        ("item", "method", "n", "mean", "SD", "SE", "p, not adjusted"),
        rows,
        labels=2,
        note="p: signed-rank test between the two methods; exploratory but for “like”.",
    )


def explored_rows(results: Results) -> Table:
    """Measures beyond the paper between the two methods."""
    rows = []
    for e in results.explored:
        means = "; ".join(f"{m} {mean_and_sd(v, sd)}" for m, (v, sd, _) in e.means.items())
        d, r = e.difference, e.ranks
        rows.append(
            (
                e.label,
                means,
                str(d.n) if d else DASH,
                number(d.dz) if d else DASH,
                p_value(r.p) if r else DASH,
                p_value(e.adjusted),
                str(e.undefined),
            )
        )
    return Table(
        "Beyond the paper",
        ("measure", "mean ± SD over participants", "n", "dz", "p", "p adj.", "undefined"),
        tuple(rows),
        labels=2,
        note="Exploratory: signed-rank tests, Benjamini–Hochberg over this table. Undefined: "
        "counted trials without a value.",
    )


def learning_rows(results: Results) -> Table:
    """Slopes of time over trials."""
    rows = tuple(
        (t.method, str(t.n), f"{number(t.slope)} {interval(t.low, t.high)}", p_value(t.p))
        for t in results.trends
    )
    return Table(
        "Learning: change of time per further trial [s], objects' means removed",
        ("method", "participants", "slope, 95 %", "p"),
        rows,
    )


def describe_carryover(found: Carryover, contrast: tuple[str, str]) -> str:
    """Whether the order mattered, in a sentence."""
    parts = "; ".join(
        f"{number(mean)} s for the {n} who began with {method}"
        for method, (mean, n) in found.first.items()
    )
    return (
        f"Order: {contrast[0]} − {contrast[1]} in time was {parts} "
        f"(Welch's t between the groups: p {p_value(found.p)})."
    )


def link_rows(results: Results) -> Table:
    """Correlations of link and loop with time and input."""
    rows = tuple(
        (k.quality, k.measure, str(k.n_trials), number(k.r), str(k.df), p_value(k.p))
        for k in results.links
    )
    return Table(
        "Link and loop: correlation within participant and method",
        ("quality", "measure", "trials", "r", "df", "p"),
        rows,
        labels=2,
        note="Repeated-measures correlation; exploratory, not adjusted.",
    )


def factor_rows(name: str, frame: Frame) -> Table:
    """Means by method and level of a further factor."""
    rows = tuple(
        (
            str(r["method"]),
            str(r["level"]),
            str(r["n"]),
            number(r["time_s"]),
            number(r["input_s"]),
        )
        for r in frame.to_dict("records")
    )
    headings = ("method", name, "participants", "time [s]", "input [s]")
    return Table(f"Factor: {name}", headings, rows, labels=2)
