"""What the capacity bench and the soak say of time, memory and capacity follows from their data."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from app.bench.capacity import CapacityError, Load, bench_capacity, capacity_of, search
from app.bench.served import Usage
from app.bench.soak import Sample, SoakError, bench_soak, slope, summarize
from app.bench.ticks import Punctuality, clock_drift, read_punctuality, skipped_slots
from app.cli import build_parser
from app.recording.schema import TrialEvent
from app.recording.store import open_session
from app.recording.writer import TrialWriter
from app.session.pacing import Pacer
from tests.recording.samples import make_header, make_step, make_summary


class FakeTime:
    """A clock that sleeps at once, and a tick that takes as long as it is told."""

    def __init__(self) -> None:
        self.now = 100.0

    def clock(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


def paced(costs: list[float]) -> tuple[list[float], list[float], int]:
    """Times and lateness of ticks that cost so much [s], and the slots the pacer says it lost."""
    time = FakeTime()
    pacer = Pacer(0.01, time.clock, time.sleep, time.sleep)
    at, late, lost = [], [], 0
    for cost in costs:
        beat = pacer.wait()
        at.append(beat.at_s)
        late.append(beat.lateness_s)
        lost += beat.skipped
        time.now += cost
    return at, late, lost


def test_lost_slots_are_counted_as_the_pacer_counts_them() -> None:
    """From lateness alone, whatever the costs; and such a loop has not drifted."""
    rng = np.random.default_rng(1)
    costs = np.where(rng.random(800) < 0.1, rng.uniform(0.011, 0.06, 800), 0.002).tolist()
    at, late, lost = paced(costs)
    skipped = skipped_slots(np.array(late))
    assert int(skipped.sum()) == lost > 50
    assert clock_drift(np.array(at), np.array(late), skipped) < 1e-9


def test_a_clock_that_runs_away_is_seen() -> None:
    """A period that is a thousandth too long shows after ten seconds."""
    at = np.linspace(5.0, 5.0 + 0.01001 * 999, 1000)
    none = np.zeros(1000)
    assert clock_drift(at, none, none.astype(int)) == pytest.approx(0.009, rel=0.02)


def test_ticks_are_read_from_the_logs_of_a_window(tmp_path: Path) -> None:
    """Only those within it; a log's own word on lost slots stands beside the count."""
    folder = open_session(tmp_path, "demo", "p1", "1")
    writer = TrialWriter(folder, make_header())
    for number in range(100):
        late = 0.025 if number == 50 else 0.0
        step = make_step(number, monotonic_s=10.0 + 0.01 * number)
        writer.write(msgspec.structs.replace(step, lateness_s=late))
    for number in (5, 50):
        writer.write_event(
            TrialEvent(time_s=0.0, wall_s=0.0, step=number, name="late", detail='{"skipped": 2}')
        )
    writer.close(make_summary(steps=100))
    writer.join()
    found = read_punctuality(tmp_path, 10.2, 10.695)
    assert (found.ticks, found.lost, found.told) == (50, 2, 2)
    assert found.kept == pytest.approx(50 / 52)
    assert read_punctuality(tmp_path, 99.0).ticks == 0


def load(sessions: int, kept: float) -> Load:
    """A measurement of so many sessions."""
    return Load(sessions, kept, 1000, 0, 0, 0.1, 1.0, 20.0, 0.5, 50.0)


@pytest.mark.parametrize(("most", "found"), [(0, 0), (1, 1), (3, 3), (5, 5), (7, 7), (12, 12)])
def test_the_search_finds_the_last_number_that_does_well(most: int, found: int) -> None:
    """By halving the gap; no number is measured twice."""
    measured: list[int] = []

    def measure(sessions: int) -> Load:
        measured.append(sessions)
        return load(sessions, 1.0 if sessions <= most else 0.9)

    loads = search((1, 2, 4, 8, 12), measure)
    assert capacity_of(loads) == found
    assert len(measured) == len(set(measured)) == len(loads)
    assert {1, 2, 4, 8, 12} <= set(measured)


def test_a_lucky_larger_number_does_not_count() -> None:
    """Where four sessions lose ticks, six that do not are chance."""
    assert capacity_of([load(6, 1.0), load(2, 0.995), load(4, 0.98)]) == 2


def test_a_soak_counts_growth_after_it_is_warm() -> None:
    """A leak shows as MB an hour; what fills at first does not."""

    def samples(leak: float) -> list[Sample]:
        def memory(at: float) -> int:
            return int((300 + min(at, 100.0) + leak * at / 3600) * 1e6)

        return [
            Sample(at, Usage(memory(at), 0, 0.0, 80, 6), round(120 * at), round(1e5 * at))
            for at in np.linspace(0, 3600, 61)
        ]

    ticks = Punctuality(100, 0, 0, np.full(100, 2e-4), 1e-3)
    flat, leaking = (summarize(samples(leak), ticks, 4, 9) for leak in (0.0, 50.0))
    assert flat["memory"]["an hour"] == pytest.approx(0.0, abs=0.1)
    assert leaking["memory"]["an hour"] == pytest.approx(50.0, abs=0.5)
    assert flat["viewer"]["mean"] == 25.0 and flat["status"]["mean"] == 30.0
    assert flat["clock"]["most"] == 1.0 and flat["trials"]["count"] == 13
    assert slope(np.array([1.0]), np.array([2.0])) == 0.0


def test_numbers_out_of_range_are_named() -> None:
    """Before anything is started."""
    for sizes in ((), (0,), (4, 1000)):
        with pytest.raises(CapacityError, match="valid: numbers from 1 to 200"):
            bench_capacity(sizes)
    with pytest.raises(CapacityError, match="seconds is 0.1"):
        bench_capacity((1,), 0.1)
    with pytest.raises(SoakError, match="sessions is 0"):
        bench_soak(1.0, 0)
    with pytest.raises(SoakError, match="minutes is 0"):
        bench_soak(0.0)


def test_the_command_line_knows_both() -> None:
    """`bench capacity --sessions 1 2`, `bench soak --minutes 60 --sessions 4`."""
    args = build_parser().parse_args(["bench", "capacity", "--sessions", "1", "2", "--keep"])
    assert (args.what, args.sessions, args.keep) == ("capacity", [1, 2], True)
    args = build_parser().parse_args(["bench", "soak", "--minutes", "60", "--sessions", "4"])
    assert (args.what, args.minutes, args.sessions) == ("soak", 60.0, [4])
