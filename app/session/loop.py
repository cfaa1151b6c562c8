"""The clock of a live session: one tick every 10 ms, late ones told, none in haste."""

import gc
import statistics
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from app.session.pacing import Beat, Pacer

LATE_SHARE = 0.5
"""A tick is late when it begins this share of a period after its time."""
_WINDOW = 100  # ticks that the figures on the page look back on


@dataclass(frozen=True, slots=True)
class Health:
    """How well the loop keeps its time.

    Attributes:
        hz: Ticks a second, over the last 100.
        late: Late or lost ticks since the start.
        lateness_ms: Median over the last 100 ticks.
        kept: Share of all slots that had their tick.
    """

    hz: float = 0.0
    late: int = 0
    lateness_ms: float = 0.0
    kept: float = 1.0


class HealthMeter:
    """Counts beats."""

    def __init__(self, period_s: float) -> None:
        self._period = period_s
        self._times: deque[float] = deque(maxlen=_WINDOW)
        self._lateness: deque[float] = deque(maxlen=_WINDOW)
        self.ticks = 0
        self.skipped = 0
        self.late = 0
        self._health = Health()

    def add(self, beat: Beat) -> None:
        """Count one beat and the slots lost before it."""
        self._times.append(beat.at_s)
        self._lateness.append(beat.lateness_s)
        self.ticks += 1
        self.skipped += beat.skipped
        self.late += beat.skipped + (beat.lateness_s > LATE_SHARE * self._period)

    def health(self) -> Health:
        """The figures, at most 10 ticks old."""
        if self.ticks % 10 == 0 and len(self._times) > 1:
            span = self._times[-1] - self._times[0]
            self._health = Health(
                hz=(len(self._times) - 1) / span if span > 0 else 0.0,
                late=self.late,
                lateness_ms=1000 * statistics.median(self._lateness),
                kept=self.ticks / (self.ticks + self.skipped),
            )
        return self._health


class Loop:
    """Calls a tick at every beat until it is told to stop."""

    def __init__(
        self,
        pacer: Pacer,
        meter: HealthMeter,
        tick: Callable[[Beat], None],
        ended: Callable[[], bool],
    ) -> None:
        """Prepare; nothing runs before `run`.

        Args:
            pacer: When.
            meter: Told every beat.
            tick: What; may not block.
            ended: Asked at every beat whether to stop.
        """
        self._pacer = pacer
        self._meter = meter
        self._tick = tick
        self._ended = ended

    def run(self) -> None:
        """Tick until stopped; an exception of a tick ends the loop and is passed on.

        What exists at the start is taken out of the garbage collector's sight, so that its
        sweeps look at the loop's few new objects only.
        """
        gc.collect()
        gc.freeze()
        self._pacer.restart()
        while not self._ended():
            beat = self._pacer.wait()
            if self._ended():
                return
            self._meter.add(beat)
            self._tick(beat)
