"""The bench of recording gives figures of the form the bench command prints."""

import pytest

from app.bench.record import bench_record


def test_the_figures_have_median_p99_and_unit() -> None:
    """Few steps: the figures themselves are for a quiet machine."""
    figures = bench_record(n_steps=8)
    assert {name: figure["unit"] for name, figure in figures.items()} == {
        "record": "ms",
        "record_step": "µs",
        "record_tick": "ms",
    }
    assert 0 < figures["record"]["median"] <= figures["record"]["p99"]
    assert figures["record_step"]["median"] == pytest.approx(1e3 * figures["record"]["median"])
