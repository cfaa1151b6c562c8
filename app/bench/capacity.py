"""`hindsight bench capacity`: how many sessions this machine bears, each steered and watched.

The whole program is measured: a server, its workers with physics, log and 3-D view, and a visitor
each who pushes the sticks in circles under `policy` and takes everything that the viewer is sent.
The visitors run on the same cores, which real ones do not; the figures are on the safe side.
"""

import asyncio
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from app.bench.served import Served, served
from app.bench.ticks import read_punctuality
from app.bench.visitor import Visitor
from app.errors import AppError
from app.web.capacity import keep_measured

KEPT = 0.99
"""Least share of ticks that a session has to keep."""
SIZES = (1, 2, 4, 6, 8, 12)
SECONDS = 15.0
SETTLE_S = 3.0
"""After the last visitor has come in, before ticks are counted [s]."""
FOREIGN_CORES = 0.2
"""Where other programs use more than this, the measurement says little about the machine."""


class CapacityError(AppError):
    """What was asked of the bench makes no sense."""


@dataclass(frozen=True)
class Load:
    """What so many sessions at once did.

    Attributes:
        sessions: How many.
        kept: Share of all slots that had their tick.
        ticks: Ticks that took place.
        lost: Slots without one.
        told: Lost slots that the logs tell of.
        median_ms: Median lateness.
        p99_ms: 99th percentile of it.
        viewer_kb_s: What each viewer was sent.
        cores: Cores that server and workers used.
        memory_mb: What server and workers used, for each session.
        foreign: Cores that other programs used meanwhile.
    """

    sessions: int
    kept: float
    ticks: int
    lost: int
    told: int
    median_ms: float
    p99_ms: float
    viewer_kb_s: float
    cores: float
    memory_mb: float
    foreign: float = 0.0

    def to_figure(self) -> dict[str, Any]:
        """A line of the bench's table."""
        return {
            "kept %": round(100 * self.kept, 2),
            "ticks": self.ticks,
            "lost": self.lost,
            "told": self.told,
            "late ms": round(self.median_ms, 3),
            "p99 ms": round(self.p99_ms, 2),
            "viewer kB/s": round(self.viewer_kb_s, 1),
            "cores": round(self.cores, 2),
            "MB": round(self.memory_mb, 1),
            "others": round(self.foreign, 2),
        }


def bench_capacity(
    sizes: Sequence[int] = SIZES, seconds: float = SECONDS, *, keep: bool = False
) -> dict[str, dict[str, Any]]:
    """Measure so many sessions at once, then between the last that did well and the first not.

    Args:
        sizes: Numbers of sessions to begin with.
        seconds: How long each is measured [s].
        keep: Whether servers on this machine shall offer the result from now on.

    Returns:
        "4 sessions" → its figures, …, and "capacity" → the largest number with ≥ 99 % kept.

    Raises:
        CapacityError: If a number is out of range.
    """
    if not sizes or not all(1 <= size <= 200 for size in sizes):
        raise CapacityError(f"sessions are {list(sizes)}; valid: numbers from 1 to 200")
    if not 1 <= seconds <= 3600:
        raise CapacityError(f"seconds is {seconds:g}; valid: 1 to 3600")

    def measure(size: int) -> Load:
        print(f"{size} sessions …", file=sys.stderr, flush=True)
        return measure_load(size, seconds)

    loads = search(sizes, measure)
    best = capacity_of(loads)
    foreign = max(load.foreign for load in loads)
    if foreign > FOREIGN_CORES:
        kept = " Nothing is kept." if keep else ""
        print(
            f"other programs used up to {foreign:.2f} cores meanwhile: this machine bears more "
            f"than was measured; end them, and measure again.{kept}",
            file=sys.stderr,
        )
    elif keep and best:
        print(f"kept in {keep_measured(best)}", file=sys.stderr)
    figures = {f"{load.sessions} sessions": load.to_figure() for load in loads}
    return figures | {"capacity": {"sessions": best}}


def search(sizes: Sequence[int], measure: Callable[[int], Load]) -> list[Load]:
    """Measure these sizes, then halve the gap below the first that is too many."""
    loads = {size: measure(size) for size in sorted(set(sizes))}
    while True:
        good = capacity_of(loads.values())
        above = [size for size in loads if size > good]
        if not above or min(above) - good <= 1:
            return [loads[size] for size in sorted(loads)]
        between = (good + min(above)) // 2
        loads[between] = measure(between)


def capacity_of(loads: Iterable[Load]) -> int:
    """The largest number of sessions such that it and all smaller ones measured did well."""
    best = 0
    for load in sorted(loads, key=lambda load: load.sessions):
        if load.kept < KEPT:
            break
        best = load.sessions
    return best


def measure_load(sessions: int, seconds: float) -> Load:
    """So many sessions at once, for so long."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        with served(root, sessions) as server:
            visit = asyncio.run(_visit(server, sessions, seconds))
        begin, end = visit.begin_s, visit.end_s
        ticks = read_punctuality(root, begin, end)
    median, p99 = np.percentile(1e3 * ticks.lateness_s, [50, 99]) if ticks.ticks else (0.0, 0.0)
    return Load(
        sessions=sessions,
        kept=ticks.kept,
        ticks=ticks.ticks,
        lost=ticks.lost,
        told=ticks.told,
        median_ms=float(median),
        p99_ms=float(p99),
        viewer_kb_s=visit.viewer_bytes / 1e3 / (end - begin) / sessions,
        cores=visit.cores,
        memory_mb=visit.memory_bytes / 1e6 / sessions,
        foreign=visit.foreign,
    )


@dataclass(frozen=True)
class _Visit:
    """What was counted from outside: times on the monotonic clock [s], and `Load`'s sums."""

    begin_s: float
    end_s: float
    viewer_bytes: int
    cores: float
    memory_bytes: int
    foreign: float


async def _visit(server: Served, sessions: int, seconds: float) -> _Visit:
    """Let so many visitors steer for so long."""
    visitors = [Visitor(server.url) for _ in range(sessions)]
    try:
        for visitor in visitors:
            await visitor.open()
        await asyncio.sleep(SETTLE_S)
        before, sent = server.usage(), sum(visitor.viewer_bytes for visitor in visitors)
        busy, own = _busy_s(), time.process_time()
        begin = time.monotonic()
        await asyncio.sleep(seconds)
        end = time.monotonic()
        busy, own = _busy_s() - busy, time.process_time() - own
        sent = sum(visitor.viewer_bytes for visitor in visitors) - sent
        after = server.usage()
        cores = (after.cpu_s - before.cpu_s) / (end - begin)
        for visitor in visitors:
            if visitor.complaint:
                raise CapacityError(f"a session ended meanwhile: {visitor.complaint}")
        foreign = max(0.0, (busy - own) / (end - begin) - cores)
        return _Visit(begin, end, sent, cores, after.memory_bytes, foreign)
    finally:
        await asyncio.gather(*(visitor.close() for visitor in visitors))


def _busy_s() -> float:
    """Time that the whole machine's cores have worked so far, all programs together [s]."""
    times = psutil.cpu_times()
    return sum(times) - times.idle - getattr(times, "iowait", 0.0) - getattr(times, "guest", 0.0)
