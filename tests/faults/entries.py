"""Workers that break when a file appears: the real one with one of its foundations taken away.

A test touches `<sessions>/<fault>-<session>`; nothing else of the worker is changed.
"""

import contextlib
import ctypes
import errno
import json
import resource
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import viser

from app.recording.container import TrialEncoder
from app.recording.sink import FileSink
from app.session import worker
from app.session.spec import WorkerSpec
from app.session.trial import Trial

CLOCK_STEP_S = 3600.0


def main(spec: WorkerSpec, sock: socket.socket) -> None:
    """The real worker; its clock, disk, memory or viewer fail on demand."""
    switch = _Switch(spec)
    _break_clock(switch)
    _break_disk(switch)
    _break_memory(switch)
    _break_viewer(switch)
    threading.Thread(target=switch.watch, daemon=True).start()
    worker.main(spec, sock)


def hang_at_once(spec: WorkerSpec, sock: socket.socket) -> None:
    """Gets ready, then never lets Python run again: a C call that keeps the interpreter's lock."""
    hello = {"scene": {"name": spec.scene, "objects": []}, "methods": [], "settings": {}}
    ready = {"type": "ready", "viewer_port": 1, "pid": 0, "hello": hello}
    sock.sendall(json.dumps(ready).encode() + b"\n")
    ctypes.PyDLL(None).sleep(3600)


class _Switch:
    """Which faults are on, looked up in the folder of sessions."""

    def __init__(self, spec: WorkerSpec) -> None:
        self._spec = spec
        self.on: set[str] = set()
        self.when: dict[str, Callable[[], None]] = {}

    def watch(self) -> None:
        """Look at the folder again and again."""
        while True:
            for name in ("clock", "disk", "memory", "viewer"):
                there = (Path(self._spec.sessions) / f"{name}-{self._spec.id}").exists()
                if there and name not in self.on:
                    self.on.add(name)
                    self.when.get(name, lambda: None)()
                elif not there:
                    self.on.discard(name)
            time.sleep(0.02)


def _break_clock(switch: _Switch) -> None:
    """The wall clock is set forward by an hour."""
    real = time.time
    time.time = lambda: real() + CLOCK_STEP_S * ("clock" in switch.on)


def _break_disk(switch: _Switch) -> None:
    """The disk is read-only."""
    real = FileSink.take

    def take(self: FileSink, buffer: Any) -> None:
        if "disk" in switch.on:
            raise OSError(errno.EROFS, "Read-only file system")
        real(self, buffer)

    FileSink.take = take


def _break_memory(switch: _Switch) -> None:
    """No more memory than is in use now, a tick that asks for some, and none to compress a log."""
    real = Trial.step

    def flush(self: TrialEncoder) -> None:
        raise MemoryError

    def step(self: Trial, *args: Any, **options: Any) -> Any:
        if "memory" in switch.on:
            hard = resource.getrlimit(resource.RLIMIT_AS)[1]
            resource.setrlimit(resource.RLIMIT_AS, (psutil.Process().memory_info().vms, hard))
            TrialEncoder.flush = flush
            self.ballast = bytearray(1 << 30)  # type: ignore[attr-defined]
        return real(self, *args, **options)

    Trial.step = step


def _break_viewer(switch: _Switch) -> None:
    """The viewer's port is closed."""
    real = worker.view_server

    @contextlib.contextmanager
    def view_server() -> Iterator[viser.ViserServer]:
        with real() as server:
            switch.when["viewer"] = server.stop
            yield server

    worker.view_server = view_server
