"""Everything the report says, as numbers: from a folder's tables to tests, effects and notes."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from app.analysis.anova import Anova, one_way, two_way
from app.analysis.beyond import (
    Carryover,
    Explored,
    Link,
    Trend,
    explore,
    find_carryover,
    find_links,
    find_trends,
)
from app.analysis.design import Cells, choose_contrast, make_cells, order_methods
from app.analysis.exclusions import Exclusion, find_exclusions
from app.analysis.frames import Frame
from app.analysis.from_logs import count_calibration
from app.analysis.hypotheses import Hypotheses, adjust, answer_hypotheses
from app.analysis.mixed import Mixed, fit_mixed
from app.analysis.paired import Difference, Ratio, compare, ratio_of_means
from app.analysis.summaries import (
    FactorResult,
    ItemTest,
    cell_table,
    describe_gaps,
    factor_results,
    item_tests,
    outcome_table,
    survey_table,
)
from app.analysis.tables import StudyData, name_some

MAIN = ("time_s", "input_s")
CALIBRATION_LOGS = 600
"""Logs from which the calibration is counted; a larger study is sampled, and the report says so."""


@dataclass(frozen=True)
class Pair:
    """Two methods in one of the two main measures."""

    measure: str
    reference: str
    method: str
    difference: Difference
    ratio: Ratio
    adjusted: float


@dataclass(frozen=True)
class Results:
    """What `build_report` writes down. Tables carry the column names of their CSV files."""

    data: StudyData
    trials: Frame
    survey: Frame
    participants: list[str]
    exclusions: list[Exclusion]
    methods: list[str]
    contrast: tuple[str, str] | None
    outcomes: Frame
    cells: dict[str, Frame]
    anovas: list[Anova]
    pairs: list[Pair]
    hypotheses: Hypotheses | None
    mixed: list[Mixed]
    survey_means: Frame | None
    items: list[ItemTest]
    explored: list[Explored]
    trends: list[Trend]
    carryover: Carryover | None
    links: list[Link]
    factors: list[FactorResult]
    calibration: Frame | None
    notes: list[str]


def compute_results(data: StudyData, progress: Callable[[str], None]) -> Results:
    """Exclude, then test and describe; what cannot be done becomes a note, not an error."""
    notes = list(data.notes)
    exclusions = find_exclusions(data)
    out = {e.participant_id for e in exclusions}
    trials = data.trials[~data.trials["participant_id"].isin(out)].reset_index(drop=True)
    survey = data.survey[~data.survey["participant_id"].isin(out)].reset_index(drop=True)
    counted = trials[trials["counted"]]
    methods = order_methods(set(counted["method"]))
    contrast = choose_contrast(methods, data.contrast)
    notes += _describe(trials, methods, contrast, data.contrast)
    progress("tests of time and input")
    cells = {m: make_cells(trials, m) for m in MAIN}
    notes += [] if counted.empty else describe_gaps(cells["time_s"])
    progress("survey and hypotheses")
    hypotheses = answer_hypotheses(trials, survey, contrast) if contrast else None
    anovas = [a for m in MAIN for a in _anovas(cells[m], notes)]
    progress("mixed models")
    mixed = [fit_mixed(trials, m, contrast) for m in MAIN] if contrast else []
    progress("measures beyond the paper")
    calibration = data.calibration
    if calibration is None:
        calibration = _calibrate(data, counted, notes, progress)
    return Results(
        data=data,
        trials=trials,
        survey=survey,
        participants=sorted(set(trials["participant_id"])),
        exclusions=exclusions,
        methods=methods,
        contrast=contrast,
        outcomes=outcome_table(trials),
        cells={m: cell_table(trials, m) for m in MAIN},
        anovas=anovas,
        pairs=_pairs(trials, methods),
        hypotheses=hypotheses,
        mixed=mixed,
        survey_means=survey_table(survey) if len(survey) else None,
        items=item_tests(survey, contrast) if contrast else [],
        explored=explore(trials, contrast),
        trends=find_trends(trials) if len(counted) else [],
        carryover=find_carryover(trials, contrast) if contrast else None,
        links=find_links(trials) if len(counted) else [],
        factors=factor_results(trials) if len(counted) else [],
        calibration=calibration,
        notes=notes,
    )


def _describe(
    trials: Frame,
    methods: list[str],
    contrast: tuple[str, str] | None,
    wanted: tuple[str, str] | None,
) -> list[str]:
    """What there is to compare, where it is less or other than expected."""
    said = []
    if not methods:
        said.append(
            "No trial counts: "
            + ("nobody is left after the exclusions." if trials.empty else "all of them failed.")
        )
    elif contrast is None:
        said.append(f"Only one method has counted trials ({methods[0]}): nothing to compare.")
    if wanted is not None and contrast != wanted:
        said.append(f"The study compares {' with '.join(wanted)}, which has no counted trials.")
    empty = sorted(set(trials["method"]) - set(methods))
    if empty and methods:
        said.append(f"No counted trials with {name_some(empty)}.")
    undefined = {m: int(trials.loc[trials["counted"], m].isna().sum()) for m in MAIN}
    said += [
        f"{n} counted trials have no {measure} and do not enter it."
        for measure, n in undefined.items()
        if n
    ]
    return said


def _anovas(cells: Cells, notes: list[str]) -> list[Anova]:
    """The two-factor analysis where it exists, and the one-factor one beside it."""
    made: list[Anova] = []
    for analyse, name in ((two_way, "method × object"), (one_way, "method")):
        try:
            made.append(analyse(cells))
        except ValueError:
            notes.append(
                f"{cells.measure}: no ANOVA of {name}; it needs two participants with a "
                "counted trial in every cell and two levels of each factor."
            )
    return made


def _pairs(trials: Frame, methods: list[str]) -> list[Pair]:
    """Every pair of methods in both main measures, adjusted over the pairs of a measure."""
    pairs: list[Pair] = []
    for measure in MAIN:
        cells = make_cells(trials, measure)
        known = [m for m in methods if m in cells.methods]
        found: dict[str, tuple[str, str, Difference, Ratio]] = {}
        for reference, method in combinations(known, 2):
            _, means = cells.of_methods(reference, method).balanced_means()
            difference = compare(means[:, 0] - means[:, 1])
            ratio = ratio_of_means(means[:, 0], means[:, 1])
            found[f"{reference} {method}"] = (reference, method, difference, ratio)
        adjusted = adjust({name: d.p for name, (_, _, d, _) in found.items()})
        pairs += [Pair(measure, r, m, d, q, adjusted[n]) for n, (r, m, d, q) in found.items()]
    return pairs


def _calibrate(
    data: StudyData, counted: Frame, notes: list[str], progress: Callable[[str], None]
) -> Frame | None:
    rows = counted[counted["file"] != ""]
    if rows.empty:
        notes.append("Calibration of the belief needs the logs, which are not here.")
        return None
    if len(rows) > CALIBRATION_LOGS:
        picks = np.random.default_rng(0).choice(len(rows), CALIBRATION_LOGS, replace=False)
        notes.append(
            f"Calibration of the belief: {CALIBRATION_LOGS} of {len(rows)} logs, drawn at random "
            "(seed 0)."
        )
        rows = rows.iloc[np.sort(picks)]
    logs = [
        (str(method), data.folder / str(file))
        for method, file in zip(rows["method"], rows["file"], strict=True)
    ]
    table, used = count_calibration(logs, progress)
    if used < len(logs):
        notes.append(f"Calibration of the belief: {len(logs) - used} of {len(logs)} logs unusable.")
    return table if len(table) else None
