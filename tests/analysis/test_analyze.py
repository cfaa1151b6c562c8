"""Whole folders through `analyze`: good, empty, torn, simulated, large."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.analysis.command import analyze
from app.analysis.errors import AnalysisError
from app.analysis.exclusions import RULE_NAMES
from app.analysis.frames import Frame, pd
from app.analysis.load import load
from app.analysis.results import compute_results
from tests.analysis.synthetic import OBJECTS, TRIAL_COLUMNS, make_study, write_csv


def silent(text: str) -> None:
    """Progress that nobody reads."""


def trials_file(folder: Path) -> Path:
    """The trials table of a synthetic study."""
    return folder / "data" / "study-demo_trials_data.csv"


def edit_trials(folder: Path, change: Any) -> None:
    """Rewrite the trials table."""
    table = pd.read_csv(trials_file(folder), dtype=str, keep_default_na=False)
    change(table).to_csv(trials_file(folder), index=False)


def results_of(report: Path) -> dict[str, Any]:
    """What results.json beside a report holds."""
    return json.loads((report.parent / "tables" / "results.json").read_text())


@pytest.fixture(scope="module")
def reported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of twelve with logs and rules, reported on once; the path of its report."""
    folder = make_study(tmp_path_factory.mktemp("study"), n=12, logs=12)
    (folder / "study.yaml").write_text(
        "exclusions:\n  - max_failed: 1\n  - device: [keyboard]\n"
        "analysis: {reference: blend, method: policy}\n"
    )
    return analyze(folder)


def test_a_study_gives_report_tables_and_figures(reported: Path) -> None:
    """All sections, all files; figures as PDF and PNG with embedded TrueType fonts."""
    text = reported.read_text()
    for heading in ("Participants and exclusions", "Hypotheses", "Trajectories", "Survey"):
        assert f"<h2>{heading}</h2>" in text
    figures = reported.parent / "figures"
    names = {"time-and-input", "survey", "traces-1", "traces-2", "explored", "calibration"}
    for name in names:
        assert (figures / f"{name}.png").stat().st_size > 1000
        pdf = (figures / f"{name}.pdf").read_bytes()
        assert b"/Type /Font" in pdf and b"/Subtype /Type3" not in pdf
        assert f'id="{name}"' in text


def test_the_report_needs_nothing_from_outside(reported: Path) -> None:
    """No script, no link, no file is fetched; every reference stays on the page."""
    text = reported.read_text()
    assert not re.search(r"<(script|link|img|iframe)\b|@import|src=", text)
    targets = re.findall(r'href="([^"]*)"', text) + re.findall(r"url\(([^)]*)\)", text)
    assert targets and all(t.startswith("#") for t in targets)


def test_every_reference_on_the_page_has_its_target(reported: Path) -> None:
    """Figures share one page: their ids neither collide in meaning nor dangle."""
    text = reported.read_text()
    ids = set(re.findall(r'\bid="([^"]+)"', text))
    wanted = set(re.findall(r'href="#([^"]+)"', text)) | set(re.findall(r"url\(#([^)]+)\)", text))
    assert wanted <= ids


def test_drawings_follow_the_theme(reported: Path) -> None:
    """Colours of the drawings are the page's variables, and all of them are defined."""
    text = reported.read_text()
    used = set(re.findall(r"var\(--([\w-]+)\)", text))
    defined = set(re.findall(r"--([\w-]+):#", text))
    assert {"m2", "m3", "text", "user", "assist"} <= used <= defined


def test_known_effects_are_found(reported: Path) -> None:
    """Policy was made a third faster with less input; the answers say so, with n."""
    results = results_of(reported)
    verdicts = {v["name"]: v for v in results["hypotheses"]["verdicts"]}
    assert verdicts["H1"]["answer"] == verdicts["H2"]["answer"] == "supported"
    ratio = results["hypotheses"]["time"]["ratio"]
    assert ratio["low"] < 1 / 0.68 < ratio["high"]
    assert "n = " in verdicts["H1"]["words"]
    assert all(a["agreement"] < 1e-8 for a in results["anova"])


def test_exclusions_say_who_why_and_by_which_rule(reported: Path) -> None:
    """More than one failed trial: out, named, and not among those analysed."""
    trials = pd.read_csv(trials_file(reported.parents[1]))
    failed = (~trials["success"]).groupby(trials["participant_id"]).sum()
    expected = sorted(failed[failed > 1].index)
    results = results_of(reported)
    listed = results["tables"]["exclusions"]
    assert expected and [e["participant_id"] for e in listed] == expected
    assert all(e["rule"] == "max_failed: 1" and "failed trials" in e["reason"] for e in listed)
    assert not set(expected) & set(results["participants"])


@pytest.mark.slow
def test_the_same_folder_gives_the_same_report(tmp_path: Path) -> None:
    """No clock and no chance in the page: the bytes are equal."""
    folder = make_study(tmp_path / "study", n=5)
    first, second = analyze(folder, tmp_path / "a"), analyze(folder, tmp_path / "b")
    assert first.read_bytes() == second.read_bytes()


def test_an_empty_folder_says_what_is_missing(tmp_path: Path) -> None:
    """No folder, nothing in it, or a table of headings only."""
    with pytest.raises(AnalysisError, match="no folder"):
        analyze(tmp_path / "nowhere")
    with pytest.raises(AnalysisError, match="holds no trials.*trials.parquet"):
        analyze(tmp_path)
    (tmp_path / "data").mkdir()
    write_csv(trials_file(tmp_path), [], TRIAL_COLUMNS)
    with pytest.raises(AnalysisError, match="holds no trials"):
        analyze(tmp_path)


def test_a_missing_column_is_named(tmp_path: Path) -> None:
    """Without methods nothing can be compared: the error names the column."""
    folder = make_study(tmp_path, n=3)
    edit_trials(folder, lambda t: t.drop(columns=["method"]))
    with pytest.raises(AnalysisError, match="lacks the columns method"):
        analyze(folder)


@pytest.mark.slow
def test_one_participant_is_described_but_not_tested(tmp_path: Path) -> None:
    """Means and figures; no hypothesis is answered, and the report says why."""
    report = analyze(make_study(tmp_path, n=1, logs=1))
    verdicts = results_of(report)["hypotheses"]["verdicts"]
    assert [v["answer"] for v in verdicts[:2]] == ["not tested", "not tested"]
    assert "1 participants have both methods" in verdicts[0]["words"]


def test_all_failed_gives_a_report_that_says_so(tmp_path: Path) -> None:
    """Nothing counts: outcomes are shown, nothing is tested."""
    folder = make_study(tmp_path, n=4)
    edit_trials(
        folder,
        lambda t: t.assign(success="False", counted="False", outcome="timeout"),
    )
    report = analyze(folder)
    text = report.read_text()
    assert "all of them failed" in text and "timeout" in text
    assert results_of(report)["hypotheses"] is None


@pytest.mark.slow
def test_a_torn_folder_loses_only_what_is_torn(tmp_path: Path) -> None:
    """A line cut off, a log cut off, no participants: each said, the rest analysed."""
    folder = make_study(tmp_path, n=6, logs=2)
    text = trials_file(folder).read_text()
    trials_file(folder).write_text(text[: len(text) - 60])
    (folder / "data" / "study-demo_participants_data.csv").unlink()
    log = next(folder.rglob("*.mcap"))
    log.write_bytes(log.read_bytes()[:500])
    report = analyze(folder)
    notes = " ".join(results_of(report)["notes"])
    assert "torn" in notes and "no participants table" in notes and "logs unusable" in notes
    assert len(results_of(report)["participants"]) == 6


@pytest.mark.slow
def test_without_a_table_rows_come_from_the_logs(tmp_path: Path) -> None:
    """Only logs: the derived times are the summaries', and an unfinished log is said."""
    folder = make_study(tmp_path / "study", n=4, logs=4, failures=False)
    table = pd.read_csv(trials_file(folder))
    for path in (folder / "data").glob("*.csv"):
        path.unlink()
    (folder / "dataset_description.json").unlink()
    whole = folder / "data/raw/subject-p0001/session-1/trial-001.mcap"
    torn = whole.with_name("trial-009.mcap.part")
    torn.write_bytes(whole.read_bytes()[:-3000])
    data = load(folder, silent)
    assert data.kind == "sessions" and len(data.trials) == len(table) + 1
    derived = data.trials[data.trials["outcome"] != "interrupted"]
    merged = derived.merge(table, on=["participant_id", "trial"], suffixes=("", "_table"))
    assert np.allclose(merged["time_s"], merged["time_s_table"])
    assert (merged["object"] == merged["object_table"]).all() and merged["counted"].all()
    assert np.isfinite(derived["log_loss"]).all()
    assert "not finished" in " ".join(data.notes)
    assert analyze(folder, tmp_path / "out").is_file()


def make_run(folder: Path, n: int = 40) -> Path:
    """A simulated run: paired trials, each user one object with three methods; no survey."""
    source = make_study(
        folder / "source", n=n, methods=("direct", "blend", "policy"), failures=True, survey=False
    )
    rows = pd.read_csv(trials_file(source), keep_default_na=False)
    shutil.rmtree(source)
    for column in ("cancel_s",):
        rows[column] = pd.to_numeric(rows[column], errors="coerce")
    kept = [OBJECTS[int(p[1:]) % 3] for p in rows["participant_id"]]
    rows = rows[(rows["object"] == kept) & (rows["attempt"] == 1)].assign(world="kinematic")
    rows.to_parquet(folder / "trials.parquet")
    (folder / "config.json").write_text("{}")
    return folder


def test_a_simulated_run_is_analysed_over_pairs(tmp_path: Path) -> None:
    """No user has every object: one-factor analysis, said; three methods in every table."""
    results = compute_results(load(make_run(tmp_path), silent), silent)
    assert results.data.kind == "simulated run"
    assert results.methods == ["direct", "blend", "policy"]
    assert results.contrast == ("blend", "policy")
    assert results.hypotheses is not None
    time = results.hypotheses.time
    assert time.anova is not None and time.anova.factors == "method"
    assert "every cell" in time.note
    assert len(results.pairs) == 6
    assert results.hypotheses.verdicts[2].answer == "not tested"
    assert analyze(tmp_path).is_file()


def test_missing_cells_and_unequal_counts_are_said(tmp_path: Path) -> None:
    """One cell emptied, one doubled: n and the participant left out are named."""
    folder = make_study(tmp_path, n=6, failures=False)

    def change(t: Frame) -> Frame:
        first = (t["participant_id"] == "p0003") & (t["method"] == "policy")
        gone = first & (t["object"] == "glass")
        extra = t[(t["participant_id"] == "p0001") & (t["object"] == "glass")]
        return pd.concat([t[~gone], extra.assign(trial="99")])

    edit_trials(folder, change)
    results = compute_results(load(folder, silent), silent)
    both = next(a for a in results.anovas if a.factors == "method × object")
    assert (both.n, both.dropped) == (5, ("p0003",))
    assert any("cells" in note and "no counted trial" in note for note in results.notes)
    assert any("between 1 and 2 counted trials" in note for note in results.notes)
    one = next(a for a in results.anovas if a.factors == "method")
    assert one.n == 6


def test_a_further_factor_is_analysed_with_the_method(tmp_path: Path) -> None:
    """A gain that varies within participants: means, and method × gain."""
    folder = make_study(tmp_path, n=6, failures=False)
    edit_trials(
        folder,
        lambda t: t.assign(
            options=['{"gain": 0.5}' if o == "block" else '{"gain": 1.0}' for o in t["object"]]
        ),
    )
    results = compute_results(load(folder, silent), silent)
    gain = next(f for f in results.factors if f.name == "gain")
    assert gain.anova is not None
    assert [e.source for e in gain.anova.effects] == ["method", "gain", "method × gain"]
    assert set(gain.means["level"]) == {"0.5", "1.0"}


def test_an_unknown_rule_lists_the_valid_ones(tmp_path: Path) -> None:
    """A misspelt rule stops the analysis before any number is shown."""
    folder = make_study(tmp_path, n=3)
    (folder / "study.yaml").write_text("exclusions: [{max_fails: 3}]\n")
    with pytest.raises(AnalysisError, match="max_fails") as raised:
        analyze(folder)
    assert all(name in str(raised.value) for name in RULE_NAMES)
    (folder / "study.yaml").write_text("exclusions: [{max_failed: many}]\n")
    with pytest.raises(AnalysisError, match="needs a number"):
        analyze(folder)


@pytest.mark.parametrize(
    ("rule", "reason"),
    [
        ("min_counted: 7", "6 counted trials"),
        ("min_counted_per_method: 4", "3 counted trials with blend"),
        ("max_round_trip_ms: 0.001", "median round_trip_ms"),
        ("prior_exposure: no", "prior_exposure is no"),
        ("max_blurs: -1", "times left the window"),
    ],
)
def test_every_kind_of_rule_excludes(tmp_path: Path, rule: str, reason: str) -> None:
    """Rules on counts, on link and on answers; all excluded still gives a report."""
    folder = make_study(tmp_path, n=3, failures=False)
    (folder / "study.yaml").write_text(f"exclusions:\n  - {rule}\n")
    results = compute_results(load(folder, silent), silent)
    assert len(results.exclusions) == 3
    assert all(reason in e.reason for e in results.exclusions)
    assert "nobody is left" in " ".join(results.notes)


def test_who_withdrew_never_enters(tmp_path: Path) -> None:
    """By the status column, whatever the rules; the reason is the experimenter's."""
    folder = make_study(tmp_path, n=4)
    path = folder / "data" / "study-demo_participants_data.csv"
    people = pd.read_csv(path, dtype=str, keep_default_na=False)
    people.loc[1, ["status", "excluded_by"]] = ["excluded", "fire alarm"]
    people.loc[2, "status"] = "withdrawn"
    people.to_csv(path, index=False)
    results = compute_results(load(folder, silent), silent)
    found = {e.participant_id: (e.reason, e.rule) for e in results.exclusions}
    assert found["p0002"] == ("excluded by the experimenter: fire alarm", "status")
    assert found["p0003"] == ("withdrew", "status")
    assert results.participants == ["p0001", "p0004"]


def test_text_of_participants_cannot_become_markup(tmp_path: Path) -> None:
    """Names from tables are escaped."""
    folder = make_study(tmp_path, n=3)
    edit_trials(folder, lambda t: t.assign(object=t["object"].replace("glass", "<b>glass</b>")))
    text = analyze(folder).read_text()
    assert "<b>glass</b>" not in text and "&lt;b&gt;glass" in text


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_five_hundred_participants_with_progress(tmp_path: Path) -> None:
    """A large study goes through with progress on the way, and the effects are found."""
    folder = make_study(tmp_path, n=500, methods=("direct", "blend", "policy", "yielding"))
    told: list[str] = []
    report = analyze(folder, None, told.append)
    assert len(told) >= 8
    assert results_of(report)["hypotheses"]["verdicts"][0]["answer"] == "supported"
