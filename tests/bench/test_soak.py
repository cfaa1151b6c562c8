"""The benches of whole servers, at their shortest: real workers, real viewers, real logs."""

import pytest

from app.bench.capacity import bench_capacity
from app.bench.soak import bench_soak

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


def test_one_session_is_measured_from_its_log() -> None:
    """Every lost slot is told in the log; the viewer was sent something, and not too much."""
    figures = bench_capacity((1,), 5.0)
    one = figures["1 sessions"]
    assert one["ticks"] + one["lost"] == pytest.approx(500, rel=0.05)
    assert one["told"] == one["lost"]
    assert 0 < one["viewer kB/s"] <= 40  # the first picture of the slice included
    assert one["MB"] > 10
    assert figures["capacity"]["sessions"] in (0, 1)


def test_a_short_soak_stays_flat() -> None:
    """A minute of two sessions: no session ends, nothing piles up, no loop drifts."""
    figures = bench_soak(1.0, 2, say=lambda _: None)
    assert figures["trials"]["count"] >= 2
    assert figures["memory"]["last"] < 1.15 * figures["memory"]["first"] + 20
    assert figures["handles"]["last"] <= figures["handles"]["first"] + 8
    assert figures["clock"]["most"] <= 10.0  # [ms]: one slot
    assert figures["status"]["mean"] > 1.0
