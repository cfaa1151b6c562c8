"""The benches of whole servers, at their shortest: real workers, real viewers, real logs."""

import signal
import subprocess
import sys

import psutil
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


def test_a_bench_that_is_told_to_end_takes_its_server_along() -> None:
    """SIGTERM in mid-run: neither the server nor a worker is left."""
    command = [sys.executable, "-u", "-m", "app", "bench", "soak", "--sessions", "1"]
    process = psutil.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        assert "processes" in process.stderr.readline()
        started = process.children(recursive=True)
        assert len(started) >= 3  # the server, its forkserver, a worker
        process.send_signal(signal.SIGTERM)
        assert process.wait(90) == 130
        _, left = psutil.wait_procs(started, timeout=30)
        assert not left
    finally:
        if process.is_running():
            process.kill()
        process.stderr.close()
