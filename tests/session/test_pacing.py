"""The clock of the loop: no drift, no haste, early only within the slot."""

import threading
import time
from collections.abc import Callable

import pytest

from app.session.loop import HealthMeter, Loop
from app.session.pacing import Beat, Pacer
from app.session.readers import LatestReader


class FakeTime:
    """A clock that waiting advances; stands in for time.sleep and the event's wait."""

    def __init__(self, pacer_period: float) -> None:
        self.now = 100.0
        self.pacer = Pacer(pacer_period, clock=lambda: self.now, sleep=self.sleep, wait=self.wait)
        self.wake_after: float | None = None

    def sleep(self, seconds: float) -> None:
        self.now += seconds

    def wait(self, seconds: float) -> None:
        if self.wake_after is not None:
            seconds = min(seconds, self.wake_after)
            self.wake_after = None
        self.now += seconds


def test_ticks_do_not_drift():
    """However long ticks take within their slots, tick k begins at t₀ + k dt."""
    fake = FakeTime(0.01)
    for k in range(1, 1001):
        beat = fake.pacer.wait()
        assert beat.at_s == pytest.approx(100.0 + 0.01 * k, abs=1e-9)
        assert beat.lateness_s == pytest.approx(0.0, abs=1e-9)
        fake.now += 0.003 + 0.006 * (k % 2)


def test_a_late_tick_says_so_and_the_next_is_on_time():
    """Late by less than a slot: nothing is lost."""
    fake = FakeTime(0.01)
    fake.now += 0.017
    late = fake.pacer.wait()
    assert (late.lateness_s, late.skipped) == (pytest.approx(0.007), 0)
    on_time = fake.pacer.wait()
    assert on_time.at_s == pytest.approx(100.02)
    assert on_time.lateness_s == pytest.approx(0.0, abs=1e-9)


def test_lost_slots_are_never_made_up_for():
    """After a second's pause one tick runs at once, then one a slot: no burst."""
    fake = FakeTime(0.01)
    fake.now += 1.005
    late = fake.pacer.wait()
    assert (late.skipped, late.lateness_s) == (99, pytest.approx(0.995))
    times = [fake.pacer.wait().at_s for _ in range(5)]
    assert times == pytest.approx([101.01 + 0.01 * k for k in range(5)])


def test_input_wakes_a_tick_early_but_only_one_a_slot():
    """The woken tick does not move the later ones, and a second wake waits for the next slot."""
    fake = FakeTime(0.01)
    fake.wake_after = 0.002
    early = fake.pacer.wait()
    assert (early.at_s, early.lateness_s) == (pytest.approx(100.002), 0.0)
    fake.wake_after = 0.0
    second = fake.pacer.wait()
    assert second.at_s == pytest.approx(100.01)  # its slot begins here
    assert fake.pacer.wait().at_s == pytest.approx(100.03)


def test_a_real_wake_cuts_the_wait_short():
    """The event of another thread ends the wait before the slot's end."""
    pacer = Pacer(5.0)
    threading.Timer(0.05, pacer.wake).start()
    start = time.monotonic()
    beat = pacer.wait()
    assert beat.lateness_s == 0.0
    assert time.monotonic() - start < 4.0


def test_the_meter_counts_late_and_lost_ticks():
    """A tick more than half a period late counts, and each lost slot."""
    meter = HealthMeter(0.01)
    for k in range(20):
        meter.add(Beat(1.0 + 0.01 * k, 0.0, 0))
    meter.add(Beat(1.206, 0.006, 0))
    meter.add(Beat(1.25, 0.03, 3))
    for k in range(8):
        meter.add(Beat(1.26 + 0.01 * k, 0.0, 0))
    health = meter.health()
    assert health.late == 1 + 3 + 1
    assert health.kept == pytest.approx(30 / 33)
    assert health.hz == pytest.approx(29 / 0.33)


def test_a_blocked_reader_never_slows_the_loop():
    """A viewer that hangs costs it nothing: the loop goes on, and only the viewer misses ticks."""
    hanging, release = threading.Event(), threading.Event()
    ticks: list[Beat] = []

    def hang(_: int) -> None:
        hanging.set()
        release.wait(30)

    reader: LatestReader[int] = LatestReader("hanging", hang, 1000.0, lambda error: None)

    def tick(beat: Beat) -> None:
        ticks.append(beat)
        reader.offer(len(ticks))

    pacer = Pacer(0.001)
    Loop(pacer, HealthMeter(0.001), tick, lambda: len(ticks) >= 300).run()
    assert hanging.is_set()
    assert len(ticks) == 300
    assert reader.calls == 1
    assert reader.close(timeout_s=0.0) is False
    release.set()
    assert reader.close(timeout_s=10.0) is True


def collect(rate_hz: float, errors: list[Exception]) -> tuple[list[int], LatestReader[int]]:
    """A reader that writes down what it reads; 13 is bad luck."""
    seen: list[int] = []

    def read(value: int) -> None:
        if value == 13:
            raise ValueError("13")
        seen.append(value)

    return seen, LatestReader("test", read, rate_hz, errors.append)


def until(condition: Callable[[], bool]) -> None:
    """Wait for another thread."""
    while not condition():
        time.sleep(0.001)


def test_a_reader_sees_the_newest_value_and_survives_errors():
    """Values between two calls are dropped, jobs are not, and an error is told."""
    errors: list[Exception] = []
    seen, reader = collect(1000.0, errors)
    reader.offer(13)
    until(lambda: len(errors) == 1)
    jobs: list[int] = []
    for i in range(50):
        reader.run(lambda i=i: jobs.append(i))
    for value in range(100, 200):
        reader.offer(value)
    until(lambda: bool(seen) and seen[-1] == 199)
    assert jobs == list(range(50))
    assert seen == sorted(set(seen))
    assert reader.close()


def test_a_reader_keeps_its_rate():
    """Offered far more often, it is called at its rate at most: never twice within a period."""
    times: list[float] = []
    reader: LatestReader[int] = LatestReader(
        "rate", lambda _: times.append(time.monotonic()), 50.0, lambda error: None
    )
    start = time.monotonic()
    value = 0
    while len(times) < 12:
        value += 1
        reader.offer(value)
        time.sleep(0.001)
    assert reader.close()
    # On a grid of 20 ms a late call may be followed by one on time, so count over the whole.
    assert len(times) <= (times[-1] - start) / 0.02 + 2
