"""How many sessions this machine bears: as measured by `hindsight bench capacity`, or by a rule."""

import json
import os
import platform
from dataclasses import dataclass
from pathlib import Path

import psutil

from app.robot.target_cache import cache_folder

SESSIONS_PER_CORE = 2.0
"""Two cores keep all ticks of three sessions with a moving arm, a viewer and a recorded log each,
and 91 to 99.6 % of four beside visitors that use the same cores. See `hindsight bench capacity`."""
SESSION_BYTES = 250 * 2**20
"""[byte] A worker with its viewer and the log that a full disk keeps waiting, generously."""
RESERVED_BYTES = 2**30
"""[byte] Left to the system, the web process and the forkserver."""
_CGROUP_QUOTA = Path("/sys/fs/cgroup/cpu.max")


@dataclass(frozen=True)
class Capacity:
    """How many sessions at once, and why."""

    sessions: int
    reason: str


def usable_cores() -> float:
    """Cores this process may use: fewer than the machine has under taskset or in a container."""
    try:
        cores = float(len(os.sched_getaffinity(0)))
    except AttributeError:  # not Linux
        cores = float(os.cpu_count() or 1)
    return max(0.1, min(cores, _quota()))


def find_capacity() -> Capacity:
    """What a server offers where nothing else is said."""
    sessions = read_measured()
    if sessions is not None:
        return Capacity(sessions, "measured on this machine by `hindsight bench capacity`")
    return rule(usable_cores(), psutil.virtual_memory().total)


def rule(cores: float, memory_bytes: int) -> Capacity:
    """The capacity of a machine that was not measured: by cores, or by memory where that is less.

    Args:
        cores: Usable cores.
        memory_bytes: Memory of the machine.
    """
    by_cores = max(1, int(SESSIONS_PER_CORE * cores))
    by_memory = max(1, (memory_bytes - RESERVED_BYTES) // SESSION_BYTES)
    if by_memory < by_cores:
        return Capacity(by_memory, f"{memory_bytes / 2**30:.1f} GiB of memory")
    return Capacity(by_cores, f"{SESSIONS_PER_CORE:g} a core, {cores:g} cores")


def read_measured(path: Path | None = None) -> int | None:
    """What was measured on this machine; None where nothing was, or on another one."""
    try:
        kept = json.loads((path or _measured_file()).read_text(encoding="utf-8"))
        sessions = kept["sessions"]
        if kept["machine"] == machine() and type(sessions) is int and 1 <= sessions <= 1000:
            return sessions
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return None


def keep_measured(sessions: int, path: Path | None = None) -> Path:
    """Let servers on this machine use a measured capacity from now on; returns the file."""
    file = path or _measured_file()
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps({"sessions": sessions, "machine": machine()}) + "\n")
    return file


def machine() -> str:
    """What a measurement holds for: processor and usable cores."""
    return f"{_processor()}, {usable_cores():g} cores"


def _measured_file() -> Path:
    return cache_folder() / "capacity.json"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _quota() -> float:
    """Cores that a container is granted; infinite where it is not limited."""
    try:
        quota, period = _CGROUP_QUOTA.read_text().split()
        return float("inf") if quota == "max" else int(quota) / int(period)
    except (OSError, ValueError):
        return float("inf")
