"""What runs first in a worker process, before the session's own entry.

Imported by the forkserver's children, so it imports next to nothing.
"""

import ctypes
import importlib
import select
import signal
import socket
import threading
from pathlib import Path
from typing import Any

HEARTBEAT_S = 4.0
DEAD_MAN_S = 20.0
"""The kernel ends a worker this long after the web process vanished, or after it hung [s]."""
M_MMAP_THRESHOLD, M_ARENA_MAX = -3, -8
"""glibc's numbers of the parameters."""
LARGE_BLOCK_BYTES = 128 * 1024


def run_worker(entry: str, spec: Any, sock: socket.socket) -> None:
    """Run "module:function" with the spec and the worker's end of the socket pair.

    Ctrl+C reaches the whole terminal group; the web process then ends its workers in order, so
    a worker ignores it.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _keep_the_heap_whole()
    _offer_to_the_oom_killer()
    _arm_dead_man_switch(sock)
    module, _, function = entry.partition(":")
    getattr(importlib.import_module(module), function)(spec, sock)


def _keep_the_heap_whole() -> None:
    """One heap for all threads, and blocks of 128 KiB and more mapped singly; before any thread.

    glibc raises that bound by itself at the first large block that is freed. From then on viser's
    socket, which reads into 256 KiB and keeps a few hundred bytes of it, and every trial's columns
    are cut out of the heap, which grows by the holes. And each trial's writer is a thread that may
    be given another heap, each of which grows to what the largest trial needed.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # only glibc has it
    if mallopt is not None:
        mallopt(M_MMAP_THRESHOLD, LARGE_BLOCK_BYTES)
        mallopt(M_ARENA_MAX, 1)


def _offer_to_the_oom_killer() -> None:
    """When memory runs out one session shall end, not the process that serves all of them."""
    try:
        Path("/proc/self/oom_score_adj").write_text("500")
    except OSError:
        pass  # not Linux, or a container that forbids it


def _arm_dead_man_switch(sock: socket.socket) -> None:
    """Leave no orphan, not even one that hangs inside a C call.

    A parent-death signal would come at once and cost the end of the log. Instead a timer of the
    kernel kills the process (SIGALRM's default action) unless a thread winds it again, and the
    thread stops doing so once the other end of the socket is gone. A process that cannot run
    Python any more cannot wind it either.
    """

    def wind() -> None:
        poll = select.poll()
        poll.register(sock.fileno(), 0)  # hang-ups only
        while sock.fileno() >= 0:
            signal.setitimer(signal.ITIMER_REAL, DEAD_MAN_S)
            if poll.poll(HEARTBEAT_S * 1000):
                return

    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    threading.Thread(target=wind, name="dead-man-switch", daemon=True).start()
