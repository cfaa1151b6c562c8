"""`hindsight analyze FOLDER`: from a folder of trials to a report."""

import os
from collections.abc import Callable
from pathlib import Path

from app.analysis.errors import AnalysisError
from app.analysis.figures import draw_figures
from app.analysis.load import load
from app.analysis.report import build_report
from app.analysis.results import compute_results
from app.analysis.write import write_tables

Progress = Callable[[str], None]


def analyze(folder: Path, out: Path | None = None, progress: Progress = lambda text: None) -> Path:
    """Read a folder, test, draw and write.

    Args:
        folder: A study's folder, a simulated run's, or one that holds logs.
        out: Where the report goes; FOLDER/analysis by default.
        progress: Told in a few words what is being done.

    Returns:
        The path of report.html; beside it lie tables/ (CSV, JSON) and figures/ (PDF, PNG).

    Raises:
        AnalysisError: If there is nothing to analyse, or the report cannot be written.
    """
    progress(f"reading {folder}")
    data = load(folder, progress)
    progress(f"{len(data.trials)} trials of {data.trials['participant_id'].nunique()} participants")
    results = compute_results(data, progress)
    target = folder / "analysis" if out is None else out
    try:
        for name in ("tables", "figures"):
            (target / name).mkdir(parents=True, exist_ok=True)
        figures = draw_figures(results, target / "figures", progress)
        files = [f"tables/{name}" for name in write_tables(results, target / "tables")]
        files += [f"figures/{name}.pdf and .png" for name in figures]
        progress("writing the report")
        report = target / "report.html"
        beside = target / ".report.html.part"
        beside.write_text(build_report(results, figures, files), encoding="utf-8")
        os.replace(beside, report)
    except OSError as error:
        raise AnalysisError(f"cannot write the report to {target}: {error.strerror}") from None
    return report
