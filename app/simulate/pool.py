"""Many trials on many cores: which process does a trial changes nothing in its result."""

import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import wait as wait_for

from app.simulate.errors import SimulateError
from app.simulate.plan import Study
from app.simulate.trial import Row, Runner

Done = list[tuple[int, list[Row]]]
"""Numbers of trials with their rows."""

CHUNK = 4
"""Trials in one message to a worker: few enough that little is lost with it."""
_ATTEMPTS = 3
_START_METHOD = "spawn" if sys.platform == "win32" else "forkserver"


def available_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_trials(study: Study, indices: Sequence[int], workers: int) -> Iterator[Done]:
    """Run trials, yielding them as they are done, in any order, each exactly once.

    Args:
        study: What to run.
        indices: Numbers of the trials.
        workers: Processes; 1: this one.

    Raises:
        SimulateError: If workers keep dying.
    """
    chunks = [tuple(indices[i : i + CHUNK]) for i in range(0, len(indices), CHUNK)]
    if workers == 1 or len(chunks) == 1:
        runner = Runner(study)
        for index in indices:
            yield [(index, runner.run(index))]
        return
    yield from _run_in_pool(study, deque(chunks), min(workers, len(chunks)))


def _run_in_pool(study: Study, todo: deque[tuple[int, ...]], workers: int) -> Iterator[Done]:
    context = multiprocessing.get_context(_START_METHOD)
    if _START_METHOD == "forkserver":
        context.set_forkserver_preload(["app.simulate.preload"])
    failures = 0
    while todo:
        running: dict[Future[Done], tuple[int, ...]] = {}
        pool = ProcessPoolExecutor(workers, context, initializer=_begin, initargs=(study,))
        try:
            while todo or running:
                while todo and len(running) < 2 * workers:
                    running[pool.submit(_work, todo[0])] = todo[0]
                    todo.popleft()
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    done = future.result()
                    del running[future]
                    failures = 0
                    yield done
        except BrokenProcessPool:
            # A worker died and took the pool along; what was not handed over is done again.
            todo.extendleft(reversed(running.values()))
            failures += 1
            if failures == _ATTEMPTS:
                numbers = ", ".join(str(i) for chunk in running.values() for i in chunk)
                raise SimulateError(
                    f"workers died {failures} times in a row while doing the trials {numbers}; "
                    "is there enough memory? valid: fewer --workers"
                ) from None
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


_runner: Runner | None = None


def _begin(study: Study) -> None:
    """Set a worker up: Ctrl-C is the parent's to handle, and nobody outlives the parent."""
    global _runner
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        sentinel = parent.sentinel
        threading.Thread(target=_exit_with, args=(sentinel,), daemon=True).start()
    _runner = Runner(study)


def _exit_with(sentinel: int) -> None:
    wait_for([sentinel])
    os._exit(1)


def _run_chunk(indices: tuple[int, ...]) -> Done:
    assert _runner is not None
    return [(index, _runner.run(index)) for index in indices]


_work = _run_chunk
