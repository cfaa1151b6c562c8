"""A server of ours as a process of its own, and what it and its workers use."""

import contextlib
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil

from app.errors import AppError


class ServedError(AppError):
    """The server under measurement did not start."""


@dataclass(frozen=True)
class Usage:
    """What the server and all its workers use together.

    Attributes:
        memory_bytes: Memory that each has for itself alone (USS), summed: other programs that come
            and go, and share libraries, do not change it.
        largest_bytes: That of the largest worker.
        cpu_s: Processor time since the start, of the processes that still run [s].
        handles: Open file handles.
        processes: How many there are.
    """

    memory_bytes: int
    largest_bytes: int
    cpu_s: float
    handles: int
    processes: int


@dataclass(frozen=True)
class Served:
    """A running server."""

    url: str
    process: psutil.Popen

    def usage(self) -> Usage:
        """What it uses now."""
        memory, cpu, handles = [], 0.0, 0
        for process in (self.process, *self.process.children(recursive=True)):
            with contextlib.suppress(psutil.NoSuchProcess):
                times = process.cpu_times()
                memory.append(_memory(process))
                cpu += times.user + times.system
                handles += process.num_fds()
        return Usage(sum(memory), max(memory[1:], default=0), cpu, handles, len(memory))


@contextlib.contextmanager
def served(sessions: Path, capacity: int) -> Iterator[Served]:
    """Serve on a free port with so many places; ended at the end.

    Raises:
        ServedError: With what the server said.
    """
    command = ["run", "--port", "0", "--sessions", str(sessions), "--capacity", str(capacity)]
    with running(command) as server:
        yield server


@contextlib.contextmanager
def running(arguments: Sequence[str]) -> Iterator[Served]:
    """Run `hindsight` with these arguments, which serve something; ended at the end.

    Raises:
        ServedError: With what the server said.
    """
    command = [sys.executable, "-u", "-m", "app", *arguments]
    process = psutil.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        yield Served(_read_address(process), process)
    finally:
        process.terminate()
        try:
            process.communicate(timeout=60)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def _read_address(process: psutil.Popen) -> str:
    said = ""
    for line in process.stdout:
        said += line
        for word in line.split():
            if word.startswith("http://"):
                return word.rstrip("/.,").removesuffix("/review")
    raise ServedError(f"the server ended before it named its address:\n{said}")


def _memory(process: psutil.Process) -> int:
    try:
        return process.memory_full_info().uss
    except psutil.AccessDenied:  # some systems tell it to nobody but the owner
        return process.memory_info().rss
