"""Descriptive tables: outcomes, means by method and object, survey answers, factors."""

from dataclasses import dataclass

import numpy as np

from app.analysis.anova import Anova, two_way
from app.analysis.design import Cells, find_factors, make_cells, order_methods
from app.analysis.frames import Frame, pd
from app.analysis.paired import Ranks, signed_rank

PAPER_ITEMS = ("control", "wanted", "quickly", "like", "prefer")


def outcome_table(trials: Frame) -> Frame:
    """Trials outside training by method and outcome, with the share that succeeded."""
    rows = trials[trials["part"] != "training"]
    table = pd.crosstab(rows["method"], rows["outcome"])
    table = table.reindex(order_methods(set(rows["method"])))
    table.insert(0, "trials", table.sum(axis=1))
    success = rows.groupby("method")["success"].mean()
    table["success"] = success.reindex(table.index)
    counted = rows.groupby("method")["counted"].sum()
    table["counted"] = counted.reindex(table.index)
    return table.reset_index()


def cell_table(trials: Frame, measure: str) -> Frame:
    """Mean, SD and SE over participants per method and object, and over all objects.

    SE is that of participants' means. Columns: method, object, n, trials, mean, sd, se, median.
    """
    cells = make_cells(trials, measure)
    rows = []
    for m, method in enumerate(cells.methods):
        per_object = {o: cells.means[:, m, i] for i, o in enumerate(cells.objects)}
        counts = {o: int(cells.counts[:, m, i].sum()) for i, o in enumerate(cells.objects)}
        filled = np.isfinite(cells.means[:, m])
        some = filled.any(axis=1)
        totals = np.where(filled, cells.means[:, m], 0.0).sum(axis=1)[some] / filled.sum(1)[some]
        for name, values in [*per_object.items(), ("all", totals)]:
            values = values[np.isfinite(values)]
            n = len(values)
            sd = float(values.std(ddof=1)) if n > 1 else float("nan")
            trials_n = sum(counts.values()) if name == "all" else counts[name]
            if n:
                rows.append(
                    (
                        method,
                        name,
                        n,
                        trials_n,
                        values.mean(),
                        sd,
                        sd / n**0.5,
                        float(np.median(values)),
                    )
                )
    names = ["method", "object", "n", "trials", "mean", "sd", "se", "median"]
    return pd.DataFrame(rows, columns=pd.Index(names))


def describe_gaps(cells: Cells) -> list[str]:
    """Missing cells and unequal numbers of trials, in sentences."""
    said = []
    missing = ~np.isfinite(cells.means)
    if missing.any():
        who = int(missing.any(axis=(1, 2)).sum())
        said.append(
            f"{int(missing.sum())} of {missing.size} cells (participant × method × object) hold "
            f"no counted trial; this concerns {who} of {len(cells.participants)} participants."
        )
    filled = cells.counts[cells.counts > 0]
    if len(filled) and filled.min() != filled.max():
        said.append(
            f"Cells hold between {int(filled.min())} and {int(filled.max())} counted trials; each "
            "cell enters with its mean."
        )
    return said


@dataclass(frozen=True)
class ItemTest:
    """An item of the survey between two methods; exploratory except `like`."""

    item: str
    ranks: Ranks


def survey_table(survey: Frame) -> Frame:
    """Mean, SD, SE and n of every item and method; items of the paper first."""
    per_person = survey.groupby(["item", "method", "participant_id"])["value"].mean()
    table = per_person.groupby(["item", "method"]).agg(["size", "mean", "std"]).reset_index()
    table.columns = pd.Index(["item", "method", "n", "mean", "sd"])
    table["se"] = table["sd"] / table["n"] ** 0.5
    methods = order_methods(set(table["method"]))
    place = {item: i for i, item in enumerate(PAPER_ITEMS)}
    table["_i"] = [place.get(item, len(place)) for item in table["item"]]
    table["_m"] = [methods.index(m) for m in table["method"]]
    table = table.sort_values(["_i", "item", "_m"])
    return table.drop(columns=["_i", "_m"]).reset_index(drop=True)


def item_tests(survey: Frame, contrast: tuple[str, str]) -> list[ItemTest]:
    """Signed-rank test of each item that was answered for both methods."""
    rows = survey[survey["method"].isin(contrast)]
    tests = []
    for item in dict.fromkeys(survey_table(rows)["item"]) if len(rows) else []:
        table = rows[rows["item"] == item].pivot_table(
            index="participant_id", columns="method", values="value"
        )
        if set(contrast) <= set(table.columns):
            both = table.dropna()
            differences = (both[contrast[0]] - both[contrast[1]]).to_numpy(dtype=float)
            tests.append(ItemTest(str(item), signed_rank(differences)))
    return tests


@dataclass(frozen=True)
class FactorResult:
    """A further factor: means by method and level, and its ANOVA with method where possible.

    Attributes:
        name: e.g. "gain".
        means: Columns method, level, n, mean (time) and input.
        anova: Method × factor within participants; None where it cannot be done.
        note: Why not, or that objects are pooled.
    """

    name: str
    means: Frame
    anova: Anova | None
    note: str


def factor_results(trials: Frame) -> list[FactorResult]:
    """Every factor besides method and object that differs between counted trials."""
    counted = trials[trials["counted"]]
    results = []
    for name, levels in find_factors(counted).items():
        rows = counted.assign(level=levels.astype(str))
        means = (
            rows.groupby(["method", "level"])
            .agg(
                n=("participant_id", "nunique"),
                time_s=("time_s", "mean"),
                input_s=("input_s", "mean"),
            )
            .reset_index()
        )
        within = rows.groupby("participant_id")["level"].nunique().min() > 1
        anova, note = None, "It varies between participants: means only."
        if within:
            cells = make_cells(rows.assign(object=rows["level"]), "time_s")
            if len(cells.complete().participants) >= 2 and len(cells.methods) >= 2:
                found = two_way(cells)
                effects = tuple(
                    type(e)(**{**vars(e), "source": e.source.replace("object", str(name))})
                    for e in found.effects
                )
                anova = Anova(**{**vars(found), "factors": f"method × {name}", "effects": effects})
                note = "Time, objects pooled."
            else:
                note = "Too few participants have every cell of method × this factor: means only."
        results.append(FactorResult(str(name), means, anova, note))
    return results
