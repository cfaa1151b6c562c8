"""The report: sections of text, tables and figures, filled into one self-contained page."""

from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Literal

from jinja2 import Environment, StrictUndefined

from app import __version__
from app.analysis import report_tables as tables
from app.analysis.figures import Drawn
from app.analysis.results import Results
from app.analysis.style import TOKENS
from app.analysis.tables import name_some

TEMPLATE = Path(__file__).with_name("report.html")
Kind = Literal["text", "list", "facts", "table", "figure", "verdict"]


@dataclass(frozen=True)
class Block:
    """One element of a section."""

    kind: Kind
    value: Any


@dataclass(frozen=True)
class Section:
    """A heading with its blocks."""

    id: str
    title: str
    blocks: tuple[Block, ...]


def build_report(results: Results, figures: dict[str, Drawn], files: list[str]) -> str:
    """The page as text; the same results give the same bytes."""
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    template = environment.from_string(TEMPLATE.read_text(encoding="utf-8"))
    sections = [
        _participants(results),
        _hypotheses(results),
        _outcomes(results, figures),
        _survey(results, figures),
        _traces(figures),
        _beyond(results, figures),
        _factors(results),
        _method(results, files),
    ]
    return template.render(
        title=results.data.name,
        subtitle=_subtitle(results),
        tokens=TOKENS,
        sections=[s for s in sections if s is not None],
    )


def _subtitle(results: Results) -> str:
    kind = {
        "study": "Study",
        "simulated run": "Simulated run: its participants are simulated users, not people",
        "sessions": "Live sessions, derived from their logs",
    }[results.data.kind]
    methods = ", ".join(results.methods) or "no method with a counted trial"
    return f"{kind}. Methods: {methods}."


def _participants(results: Results) -> Section:
    """Participants, exclusions, what is missing: before any result."""
    trials = results.trials
    n_all = len(set(results.data.participants["participant_id"]) | set(results.participants))
    failed = int((~trials["success"] & (trials["part"] != "training")).sum())
    facts = [
        (str(n_all), "participants"),
        (str(len(results.exclusions)), "left out"),
        (str(len(results.participants)), "analysed"),
        (str(int(trials["counted"].sum())), "counted trials"),
        (str(failed), "failed trials"),
    ]
    blocks = [Block("facts", facts)]
    table = tables.exclusion_table(results)
    if table:
        blocks.append(Block("table", table))
    else:
        blocks.append(Block("text", "Nobody was left out."))
    rules = [f"{name}: {value}" for rule in results.data.rules for name, value in rule.items()]
    said = (
        f"Rules of the study file: {'; '.join(rules)}."
        if rules
        else "The folder holds no rules of exclusion (study.yaml, exclusions)."
    )
    blocks.append(
        Block("text", f"{said} Those who withdrew, were excluded or have not finished never enter.")
    )
    background = _background(results)
    if background:
        blocks.append(Block("list", background))
    if len(results.outcomes):
        blocks.append(Block("table", tables.outcome_rows(results)))
    if results.notes:
        blocks.append(Block("text", "Missing, torn or left out:"))
        blocks.append(Block("list", results.notes))
    return Section("participants", "Participants and exclusions", tuple(blocks))


def _background(results: Results) -> list[str]:
    """Answers of those analysed to the background questions, in numbers; free text stays out."""
    people = results.data.participants
    people = people[people["participant_id"].isin(results.participants)]
    skipped = {"participant_id", "cell", "status", "excluded_by", "consent_version"}
    lines = []
    for name in people.columns:
        counts = people[name].astype(str).str.strip().replace("", "no answer").value_counts()
        if (
            name in skipped
            or len(counts) > 8
            or (len(counts) == 1 and counts.index[0] == "no answer")
        ):
            continue
        counted = ", ".join(f"{value} {n}" for value, n in counts.items())
        lines.append(f"{str(name).replace('_', ' ')}: {counted}")
    return lines


def _hypotheses(results: Results) -> Section:
    if results.hypotheses is None:
        text = "There are not two methods with counted trials: no hypothesis can be tested."
        return Section("hypotheses", "Hypotheses", (Block("text", text),))
    h = results.hypotheses
    blocks = [Block("verdict", v) for v in h.verdicts]
    blocks.append(Block("table", tables.hypothesis_rows(h)))
    tested = sum(p == p for p in h.adjusted.values())
    ranks = [
        f"Level .05; Benjamini–Hochberg over the {tested} tests that could be done.",
        tables.describe_ranks("Like", h.survey.like),
        tables.describe_ranks("Prefer", h.survey.prefer),
        "Deviation: the paper names a rank-sum test for “prefer”; against the one value 4 this is "
        "a one-sample question, for which the signed-rank test is the right one (and the paper's "
        "own p = .098 is a signed-rank p).",
    ]
    if h.survey.like_dropped:
        who = name_some(list(h.survey.like_dropped))
        ranks.insert(2, f"“Like” was answered for one method only, and left out, by {who}.")
    return Section("hypotheses", "Hypotheses", (*blocks, Block("list", ranks)))


def _outcomes(results: Results, figures: dict[str, Drawn]) -> Section:
    blocks = [Block("figure", figures["time-and-input"])] if "time-and-input" in figures else []
    blocks += [
        Block("table", tables.cell_rows(frame, measure))
        for measure, frame in results.cells.items()
        if len(frame)
    ]
    blocks += [Block("table", tables.anova_rows(a)) for a in results.anovas]
    for anova in results.anovas:
        if anova.dropped and anova.factors != "method":
            who = name_some(list(anova.dropped))
            blocks.append(Block("text", f"{anova.measure}, {anova.factors}: without {who}."))
    if results.pairs:
        blocks.append(Block("table", tables.pair_rows(results)))
    if results.mixed:
        blocks.append(Block("table", tables.mixed_rows(results)))
    if not blocks:
        blocks = [Block("text", "No counted trial: there are no times and inputs to show.")]
    return Section("time-and-input-results", "Time and input", tuple(blocks))


def _survey(results: Results, figures: dict[str, Drawn]) -> Section:
    if results.survey_means is None:
        return Section("survey", "Survey", (Block("text", "There are no survey answers."),))
    return Section(
        "survey",
        "Survey",
        (Block("figure", figures["survey"]), Block("table", tables.survey_rows(results))),
    )


def _traces(figures: dict[str, Drawn]) -> Section:
    drawn = [f for name, f in figures.items() if name.startswith("traces-")]
    if not drawn:
        text = "No logs of counted trials with both methods on one object: nothing to trace."
        return Section("trajectories", "Trajectories", (Block("text", text),))
    return Section("trajectories", "Trajectories", tuple(Block("figure", f) for f in drawn))


def _beyond(results: Results, figures: dict[str, Drawn]) -> Section | None:
    blocks: list[Block] = []

    def add(name: str, *extra: tables.Table) -> None:
        if name in figures:
            blocks.append(Block("figure", figures[name]))
        blocks.extend(Block("table", table) for table in extra)

    add("explored", *([tables.explored_rows(results)] if results.explored else []))
    add("calibration")
    add("learning", *([tables.learning_rows(results)] if results.trends else []))
    if results.carryover and results.contrast:
        sentence = tables.describe_carryover(results.carryover, results.contrast)
        blocks.append(Block("text", sentence))
    add("link", *([tables.link_rows(results)] if results.links else []))
    if not results.links and blocks:
        blocks.append(Block("text", "Link and loop: recorded nowhere, or the same in every trial."))
    return Section("beyond", "Beyond the paper", tuple(blocks)) if blocks else None


def _factors(results: Results) -> Section | None:
    blocks: list[Block] = []
    for factor in results.factors:
        blocks.append(Block("table", tables.factor_rows(factor.name, factor.means)))
        if factor.anova:
            blocks.append(Block("table", tables.anova_rows(factor.anova)))
        blocks.append(Block("text", factor.note))
    return Section("factors", "Further factors", tuple(blocks)) if blocks else None


def _method(results: Results, files: list[str]) -> Section:
    names = ("pingouin", "statsmodels", "scipy", "numpy", "pandas", "matplotlib")
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in names)
    notes = [
        "Time: from the start signal to the command that closes the hand. Input: ∫ ‖u‖₂ dt over "
        "all stick axes after the dead zone, full stick = 1. A measure that is undefined in a "
        "trial is missing there, never 0.",
        "ANOVA: each cell is a participant's mean of the counted trials; participants with an "
        "empty cell are left out and named. Corrected p: Greenhouse–Geisser. Partial η² = SS / "
        "(SS + SS error); generalised η² = SS / (SS + SS participants + SS of all errors).",
        "dz = mean / SD of the participants' differences, interval by the noncentral t.",
        "Intervals are 95 %; the bootstrap draws 2000 samples with seed 0: the same folder gives "
        "the same report.",
        f"Hindsight {__version__}; {versions}.",
        f"Files beside this page: {', '.join(files)}.",
    ]
    return Section("method", "How this was computed", (Block("list", notes),))
