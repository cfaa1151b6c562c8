"""The figures are drawn from the running code, and the bench names every size."""

from pathlib import Path

import pytest

from app.analysis.paper_figures import draw_confidence, draw_paper_figures
from app.bench import assist as bench


def test_all_figures_are_written(tmp_path: Path) -> None:
    """Figures 1–4 and the comparison of takeovers, as PNG and PDF."""
    paths = draw_paper_figures(tmp_path / "figures")
    assert len(paths) == 10
    for path in paths:
        head = path.read_bytes()[:4]
        assert head == (b"%PDF" if path.suffix == ".pdf" else b"\x89PNG")


def test_figure_2_says_what_the_paper_says() -> None:
    """Between the goals linear from 0; behind both there is progress at zero confidence."""
    figure = draw_confidence()
    panels = [axes for axes in figure.axes if axes.get_xlabel().startswith("confidence")]
    between, behind = ([line.get_ydata() for line in axes.lines] for axes in panels)
    assert between[0][0] == pytest.approx(0.0, abs=1e-9)  # type: ignore[index]
    assert between[0][20] == pytest.approx(0.5 * between[0][40], rel=1e-6)  # type: ignore[index]
    assert behind[0][0] > 40.0  # type: ignore[index, operator]


def test_the_bench_measures_both_at_every_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """{numpy, compiled} → size → microseconds."""
    monkeypatch.setattr(bench, "ROUNDS", 2)
    found = bench.bench_assist()
    assert set(found) == {"numpy", "compiled"}
    for times in found.values():
        assert list(times) == ["3x1", "3x16", "3x30", "10x30", "30x30", "100x30"]
        assert all(time > 0.0 for time in times.values())
