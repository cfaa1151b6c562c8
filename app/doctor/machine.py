"""The machine itself: clocks, timers, file handles, how many sessions it bears."""

import resource
import shutil
import statistics
import subprocess
import time
from collections.abc import Callable

import app
from app.doctor.finding import Finding
from app.web.capacity import Capacity, find_capacity, read_measured

SLEEPS = 50
SLEEP_S = 0.01
LATE_S, VERY_LATE_S = 0.001, 0.005
"""How much later than asked a sleeping process may wake: a tenth of a tick, half of one [s]."""
RELEASED_S = 1_735_689_600.0
"""2025-01-01: no clock that is right shows an earlier time [s since 1970]."""
STEADY_S = 0.25
DRIFT_S = 0.02
HANDLES_A_SESSION = 40
"""Sockets of pages and viewers, pipes and the process, in the web process."""
SPARE_HANDLES = 200


def check_clock(
    wall: Callable[[], float] = time.time,
    monotonic: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> Finding:
    """Whether the wall clock shows a possible time, runs evenly and is set by a time server.

    The control loop uses the monotonic clock only; the wall clock dates the records.
    """
    start_wall, start = wall(), monotonic()
    sleep(STEADY_S)
    drift = (wall() - start_wall) - (monotonic() - start)
    shown = time.strftime("%Y-%m-%d %H:%M", time.localtime(start_wall))
    if start_wall < RELEASED_S:
        advice = "set the clock: records are dated by it (`timedatectl set-ntp true`)"
        return Finding("Clock", "bad", f"it shows {shown}", advice)
    if abs(drift) > DRIFT_S:
        text = f"it stepped by {1e3 * drift:.0f} ms within {STEADY_S} s"
        return Finding("Clock", "warn", text, "let one program only set the clock; look again")
    if _is_synchronized() is False:
        text = f"{shown}, not set by a time server"
        return Finding("Clock", "warn", text, "`timedatectl set-ntp true`, if dates matter to you")
    return Finding("Clock", "ok", shown)


def check_timer(
    clock: Callable[[], float] = time.perf_counter, sleep: Callable[[float], None] = time.sleep
) -> Finding:
    """How punctually a sleeping process wakes: the control loop sleeps between ticks."""
    late = []
    for _ in range(SLEEPS):
        start = clock()
        sleep(SLEEP_S)
        late.append(clock() - start - SLEEP_S)
    median, longest = statistics.median(late), max(late)
    text = f"a sleep of 10 ms ends {1e3 * median:.2f} ms late (median), {1e3 * longest:.1f} at most"
    advice = "end other programs, use the power plan for performance, do not share the cores"
    if median > VERY_LATE_S:
        return Finding("Timer", "bad", text, advice)
    return (
        Finding("Timer", "warn", text, advice) if median > LATE_S else Finding("Timer", "ok", text)
    )


def check_capacity(capacity: Capacity | None = None, measured: bool | None = None) -> Finding:
    """How many sessions the server will offer at once."""
    found = capacity or find_capacity()
    text = f"{found.sessions} sessions at once ({found.reason})"
    known = read_measured() is not None if measured is None else measured
    advice = "" if known else "`hindsight bench capacity` measures it, with nothing else running"
    return Finding("Capacity", "ok", text, advice)


def check_handles(sessions: int, limit: int | None = None) -> Finding:
    """Whether so many sessions find file handles."""
    allowed = resource.getrlimit(resource.RLIMIT_NOFILE)[0] if limit is None else limit
    needed = SPARE_HANDLES + HANDLES_A_SESSION * sessions
    text = f"{allowed} allowed, {needed} needed for {sessions} sessions"
    if 0 <= allowed < needed:
        return Finding("File handles", "warn", text, f"`ulimit -n {needed}` before the start")
    return Finding("File handles", "ok", text)


def check_version() -> Finding:
    """Which Hindsight this is."""
    return Finding("Hindsight", "ok", app.__version__)


def _is_synchronized() -> bool | None:
    """Whether systemd says that a time server sets the clock; None where it does not say."""
    if not shutil.which("timedatectl"):
        return None
    try:
        done = subprocess.run(
            ["timedatectl", "show", "-p", "NTPSynchronized", "--value"],
            capture_output=True,
            text=True,
            timeout=5,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return {"yes": True, "no": False}.get(done.stdout.strip())
