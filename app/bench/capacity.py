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
    if keep and best:
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
            begin, end, sent, cores, memory = asyncio.run(_visit(server, sessions, seconds))
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
        viewer_kb_s=sent / 1e3 / (end - begin) / sessions,
        cores=cores,
        memory_mb=memory / 1e6 / sessions,
    )


async def _visit(
    server: Served, sessions: int, seconds: float
) -> tuple[float, float, int, float, int]:
    """Begin and end on the monotonic clock [s], bytes sent to viewers, cores, memory [byte]."""
    visitors = [Visitor(server.url) for _ in range(sessions)]
    try:
        for visitor in visitors:
            await visitor.open()
        await asyncio.sleep(SETTLE_S)
        before, sent = server.usage(), sum(visitor.viewer_bytes for visitor in visitors)
        begin = time.monotonic()
        await asyncio.sleep(seconds)
        end = time.monotonic()
        sent = sum(visitor.viewer_bytes for visitor in visitors) - sent
        after = server.usage()
        cores = (after.cpu_s - before.cpu_s) / (end - begin)
        for visitor in visitors:
            if visitor.complaint:
                raise CapacityError(f"a session ended meanwhile: {visitor.complaint}")
        return begin, end, sent, cores, after.memory_bytes
    finally:
        await asyncio.gather(*(visitor.close() for visitor in visitors))
