"""What runs first in a worker process: its heap."""

import ctypes
import json
import multiprocessing
import socket
from typing import Any

import pytest

from app.web.child import run_worker

LARGE = 16 * 2**20
SMALLER = 200 * 1024


class _MallInfo(ctypes.Structure):
    """glibc's `struct mallinfo2`."""

    _fields_ = [(name, ctypes.c_size_t) for name in (
        "arena", "ordblks", "smblks", "hblks", "hblkhd",
        "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost",
    )]  # fmt: skip


def mapped_blocks_after_a_large_one(spec: Any, sock: socket.socket) -> None:
    """A worker's entry: frees a large block and says how many a smaller one then adds."""
    libc = ctypes.CDLL(None)
    libc.mallinfo2.restype = _MallInfo
    libc.malloc.restype = ctypes.c_void_p
    libc.malloc.argtypes = [ctypes.c_size_t]
    libc.free.argtypes = [ctypes.c_void_p]
    libc.free(libc.malloc(LARGE))
    before = libc.mallinfo2().hblks
    block = libc.malloc(SMALLER)
    after = libc.mallinfo2().hblks
    libc.free(block)
    sock.sendall(json.dumps(after - before).encode())


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "mallinfo2"), reason="glibc alone")
def test_large_blocks_stay_out_of_the_heap_after_the_first_was_freed() -> None:
    """Else glibc raises its bound, and the heap keeps what follows."""
    ours, theirs = socket.socketpair()
    entry = f"{__name__}:{mapped_blocks_after_a_large_one.__name__}"
    context = multiprocessing.get_context("forkserver")
    process = context.Process(target=run_worker, args=(entry, None, theirs), daemon=True)
    process.start()
    with ours, theirs:
        ours.settimeout(60)
        assert json.loads(ours.recv(100)) == 1
    process.join(60)
