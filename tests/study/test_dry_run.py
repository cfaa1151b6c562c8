"""A dry run's participants, and the analysis of the study that they leave."""

from pathlib import Path

import pytest

from app.analysis.command import analyze
from app.analysis.load import load
from app.analysis.results import compute_results
from app.study.dry_run import dry_run
from app.study.errors import StudyError

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


def test_a_dry_runs_study_is_kept_and_can_be_analysed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    """Through the real server to the code, every cell as designed, and on to the paper's tables."""
    assert dry_run("paper", participants=2, out=tmp_path) == 0
    said = capsys.readouterr().out
    assert "1: 1, 2: 1" in said and "found no problem" in said
    report = analyze(tmp_path / "paper", tmp_path / "report", print)
    assert report.is_file() and (report.parent / "figures").is_dir()
    results = compute_results(load(tmp_path / "paper", print), print)
    assert len(results.participants) == 2
    with pytest.raises(StudyError, match="exists already"):
        dry_run("paper", out=tmp_path)
