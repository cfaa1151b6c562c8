"""`hindsight bench soak`: sessions that run for long: memory, handles and clocks stay flat."""

import asyncio
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from app.bench.served import Served, Usage, served
from app.bench.ticks import Punctuality, read_punctuality
from app.bench.visitor import Visitor
from app.errors import AppError

SAMPLES = 60
"""How many times the server is looked at."""
LEAST_PERIOD_S = 1.0
WARM_SHARE = 0.25
"""Of the run: caches fill and pools grow at first; growth is counted after it."""


class SoakError(AppError):
    """What was asked of the soak makes no sense, or a session did not survive it."""


@dataclass(frozen=True)
class Sample:
    """The server at one time.

    Attributes:
        at_s: Since the start [s].
        usage: What it uses.
        statuses: Status messages that all pages have received so far.
        viewer_bytes: What all viewers were sent so far.
    """

    at_s: float
    usage: Usage
    statuses: int
    viewer_bytes: int


def bench_soak(
    minutes: float = 60.0, sessions: int = 4, say: Callable[[str], None] | None = None
) -> dict[str, dict[str, Any]]:
    """Run sessions that are steered and watched all the time.

    Args:
        minutes: How long.
        sessions: How many at once.
        say: Told a line at every look; None: standard error.

    Returns:
        "memory", "handles", "viewer", "ticks", "clock" → their figures.

    Raises:
        SoakError: If a number is out of range or a session ended.
    """
    if not 0 < minutes <= 24 * 60:
        raise SoakError(f"minutes is {minutes:g}; valid: above 0, at most 1440")
    if not 1 <= sessions <= 200:
        raise SoakError(f"sessions is {sessions}; valid: 1 to 200")
    tell = say or (lambda text: print(text, file=sys.stderr, flush=True))
    with tempfile.TemporaryDirectory() as folder:
        with served(Path(folder), sessions) as server:
            samples, trials = asyncio.run(_run(server, 60.0 * minutes, sessions, tell))
        ticks = read_punctuality(Path(folder))
    return summarize(samples, ticks, sessions, trials)


def summarize(
    samples: Sequence[Sample], ticks: Punctuality, sessions: int, trials: int
) -> dict[str, dict[str, Any]]:
    """The figures of a soak; growth is a line through the samples after the first quarter."""
    late = samples[int(WARM_SHARE * len(samples)) :]
    at = np.array([sample.at_s for sample in late])
    memory = np.array([sample.usage.memory_bytes for sample in late]) / 1e6
    handles = np.array([sample.usage.handles for sample in late])
    span_s = max(1e-9, samples[-1].at_s - samples[0].at_s)
    sent = samples[-1].viewer_bytes - samples[0].viewer_bytes
    told = samples[-1].statuses - samples[0].statuses
    median, p99 = np.percentile(1e3 * ticks.lateness_s, [50, 99]) if ticks.ticks else (0.0, 0.0)
    return {
        "memory": {
            "first": round(float(memory[0]), 1),
            "last": round(float(memory[-1]), 1),
            "an hour": round(slope(at, memory) * 3600, 1),
            "unit": "MB",
        },
        "handles": {
            "first": int(handles[0]),
            "last": int(handles[-1]),
            "an hour": round(slope(at, handles) * 3600, 1),
            "unit": "",
        },
        "viewer": {"mean": round(sent / 1e3 / span_s / sessions, 1), "unit": "kB/s"},
        "status": {"mean": round(told / span_s / sessions, 1), "unit": "1/s"},
        "ticks": {
            "kept %": round(100 * ticks.kept, 3),
            "median": round(float(median), 3),
            "p99": round(float(p99), 2),
            "unit": "ms late",
        },
        "clock": {"most": round(1e3 * ticks.drift_s, 3), "unit": "ms drift in a trial"},
        "trials": {"count": trials + sessions},
    }


def slope(x: npt.ArrayLike, y: npt.ArrayLike) -> float:
    """Of the straight line through points, least squares; 0 where there are not two."""
    at, values = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if len(at) < 2 or not np.ptp(at) > 0:
        return 0.0
    return float(np.polyfit(at - at[0], values, 1)[0])


async def _run(
    server: Served, seconds: float, sessions: int, tell: Callable[[str], None]
) -> tuple[list[Sample], int]:
    visitors = [Visitor(server.url) for _ in range(sessions)]
    samples: list[Sample] = []
    try:
        for visitor in visitors:
            await visitor.open()
        begin = time.monotonic()
        period_s = max(LEAST_PERIOD_S, seconds / SAMPLES)
        while True:
            usage = await asyncio.to_thread(server.usage)
            at_s = time.monotonic() - begin
            samples.append(
                Sample(
                    at_s,
                    usage,
                    sum(visitor.statuses for visitor in visitors),
                    sum(visitor.viewer_bytes for visitor in visitors),
                )
            )
            tell(
                f"{at_s:6.0f} s  {usage.memory_bytes / 1e6:7.1f} MB  {usage.handles} handles  "
                f"{usage.processes} processes"
            )
            for visitor in visitors:
                if visitor.complaint:
                    raise SoakError(f"a session ended after {at_s:.0f} s: {visitor.complaint}")
            if at_s >= seconds:
                return samples, sum(visitor.trials for visitor in visitors)
            await asyncio.sleep(min(period_s, seconds - at_s + 0.01))
    finally:
        await asyncio.gather(*(visitor.close() for visitor in visitors))
