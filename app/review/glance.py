"""What a list shows of each trial beyond its entry: the hand's path and the share of opposition.

Both need the steps, so they are looked up beside the event loop and join the list as they come:
from the cache; where that is missing from the log, in a process of its own, which makes the cache.
"""

import logging
import os
import threading
from collections import OrderedDict
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

from app.core.measures import COLUMNS, compute_measures
from app.recording.cache import cache_path, load_cache
from app.recording.columns import TrialLog
from app.review.folder import Listed
from app.review.jobs import Job, Progress, Result, kill, run
from app.review.opening import open_trial

POINTS = 24
"""Points of a small picture's line."""
MAX_KEPT = 5000
MAX_STEPS = 60_000
"""A longer log without a cache (10 minutes, 10 s of work) waits for somebody to open it."""
POLITENESS = 10
"""Added to the niceness of a process that reads a log: whoever looks at a trial goes first."""

logger = logging.getLogger("hindsight.review")
_COLUMNS = (*COLUMNS, "hand_position_m")


class Glance(msgspec.Struct, frozen=True, kw_only=True):
    """A small picture and one measure."""

    path: list[float]
    """x y of the hand over the table [m], flat."""
    opposed: float | None
    """Share of the pushing time in which assistance opposed the input; None: nothing was pushed."""


class Glances:
    """Looks trials up one after another in a thread of its own, newest wish first."""

    def __init__(self) -> None:
        self._known: OrderedDict[tuple[Path, tuple[int, int]], Glance | None] = OrderedDict()
        self._wanted: list[Listed] = []
        self._changed = threading.Condition()
        self._closing = False
        self._thread: threading.Thread | None = None
        self._job: Job | None = None

    def get(self, listed: Listed) -> Glance | None:
        """The glance at a trial if it is known by now."""
        return self._known.get((listed.path, listed.state))

    def want(self, trials: Sequence[Listed]) -> None:
        """Look at these trials, in this order, instead of those asked for before."""
        with self._changed:
            unknown = [t for t in trials if (t.path, t.state) not in self._known]
            self._wanted = [
                t for t in unknown if t.entry.steps <= MAX_STEPS or cache_path(t.path).is_file()
            ]
            if self._wanted and self._thread is None and not self._closing:
                self._thread = threading.Thread(target=self._run, name="glances", daemon=True)
                self._thread.start()
            self._changed.notify()

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._closing = True
            self._changed.notify()
            if self._job is not None:
                self._job.cancelled = True
                kill(self._job)
        if self._thread is not None:
            self._thread.join(5.0)

    def _run(self) -> None:
        while True:
            with self._changed:
                while not self._wanted and not self._closing:
                    self._changed.wait()
                if self._closing:
                    return
                listed = self._wanted.pop(0)
            try:
                glance = self._look_at(listed.path)
            except Exception:  # a cache may hold anything; the list does without its picture
                logger.exception("no glance at %s", listed.path)
                glance = None
            with self._changed:
                self._known[listed.path, listed.state] = glance
                if len(self._known) > MAX_KEPT:
                    self._known.popitem(last=False)

    def _look_at(self, path: Path) -> Glance | None:
        log = load_cache(path, _COLUMNS)
        if log is not None:
            return glance_of(log)
        job = Job("app.review.glance:glance_job", {"path": str(path)})
        with self._changed:
            self._job, job.cancelled = job, self._closing
        run(job)
        if job.result is not None:
            return msgspec.json.decode(job.result.content, type=Glance | None)
        if not job.cancelled:
            logger.warning("no glance at %s: %s", path, job.error)
        return None


def glance_job(path: str, progress: Progress) -> Result:
    """The glance at a trial without a cache, which is made; runs as a job."""
    os.nice(POLITENESS)
    glance = glance_of(open_trial(Path(path), progress))
    return Result(msgspec.json.encode(glance), "application/json")


def glance_of(log: TrialLog) -> Glance | None:
    """The glance at a trial's steps; None where it has none."""
    if log.n_steps == 0:
        return None
    measures = compute_measures(log.steps, true_goal=None, dt=log.header.control_dt_s)
    over = log.steps["hand_position_m"][:, :2]
    rows = np.linspace(0, len(over) - 1, min(POINTS, len(over))).astype(int)
    opposed = None if np.isnan(measures.opposed) else round(measures.opposed, 4)
    return Glance(path=np.round(over[rows], 3).ravel().tolist(), opposed=opposed)
