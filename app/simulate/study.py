"""Run a study: trials over workers, progress, partial files, Ctrl-C."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from app.simulate.errors import SimulateError
from app.simulate.plan import Study
from app.simulate.pool import available_cores, run_trials
from app.simulate.store import RunFolder
from app.simulate.table import ordered
from app.simulate.trial import Row

WRITE_EVERY_S = 2.0
Progress = Callable[[int, int, float], None]
"""Told trials done, of how many, and the seconds left (NaN while unknown)."""


@dataclass(frozen=True)
class Run:
    """What became of a study.

    Attributes:
        rows: One a trial and method, in order; only trials that every method has done.
        complete: Whether all trials are done.
        problem: Why the folder could not be written; empty: it was, or there is none.
    """

    rows: list[Row]
    complete: bool
    problem: str = ""


def run_study(
    study: Study,
    *,
    workers: int = 0,
    out: Path | None = None,
    progress: Progress = lambda done, of, left: None,
) -> Run:
    """Run a study, or what a folder lacks of it; an interrupt ends it early and keeps what is done.

    Args:
        study: What to run.
        workers: Processes; 0: as many as there are cores.
        out: Folder for rows and configuration; None: nowhere.
        progress: Told after every few trials.

    Raises:
        SimulateError: If the folder holds something else, or workers keep dying.
    """
    if workers < 0:
        raise SimulateError(f"workers is {workers}; valid: 1 or more, or 0 for every core")
    folder = RunFolder(out, study) if out is not None else None
    rows = folder.read() if folder is not None else []
    per_user = len(study.scene.objects)
    there = {(int(row["participant_id"][5:]) - 1) * per_user + row["trial"] - 1 for row in rows}
    todo = [i for i in range(study.trials) if i not in there]
    fresh: list[Row] = []
    problem, interrupted = "", False
    started = written = time.monotonic()
    done = 0
    try:
        for finished in run_trials(study, todo, workers or available_cores()) if todo else ():
            fresh += [row for _, trial in finished for row in trial]
            done += len(finished)
            now = time.monotonic()
            progress(len(there) + done, study.trials, (now - started) / done * (len(todo) - done))
            if folder is not None and now - written > WRITE_EVERY_S:
                folder.add(fresh)
                rows, fresh, written = rows + fresh, [], now
    except KeyboardInterrupt:
        interrupted = True
    except OSError as error:
        if folder is None:
            raise
        problem = _refused(out, rows, study, error)
    rows, unwritten = ordered(rows + fresh), fresh
    complete = len(rows) == study.trials * len(study.methods)
    if folder is not None and not problem:
        try:
            if unwritten and not complete:
                folder.add(unwritten)
            if todo:
                folder.finish(rows, complete=complete)
        except OSError as error:
            problem = _refused(out, rows, study, error)
    if interrupted and not rows:
        raise KeyboardInterrupt
    return Run(rows, complete, problem)


def _refused(out: Path | None, rows: list[Row], study: Study, error: OSError) -> str:
    done = len(rows) // len(study.methods)
    return (
        f"{out} cannot be written ({error.strerror or error}) after {done} of {study.trials} "
        "trials; what was written stays, and the same command continues it"
    )
