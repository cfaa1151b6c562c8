"""`hindsight bench review` at its shortest: a real server, a real view, a real browser."""

import pytest

from app.bench.review import ReviewBenchError, bench_review

pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.timeout(600)]


def test_every_figure_is_measured() -> None:
    """A few seconds' trial is opened with and without its cache, scrubbed by server and page."""
    figures = bench_review(0.05, 3, n_scrubs=20)
    assert figures["first_open"]["reports"] >= 1  # that it goes on was told
    for name in ("open", "seek", "page_open", "page_scrub"):
        assert 0 < figures[name]["median"] <= figures[name]["p95"] <= figures[name]["p99"]
    assert figures["memory"]["first"] > 10
    with pytest.raises(ReviewBenchError, match="valid: 0.05 to 120"):
        bench_review(0.0)
