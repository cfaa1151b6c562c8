"""`hindsight bench review`: how soon a long trial is there, and how soon the moment one asks for.

A real server reviews a folder of long trials. What it is asked is what the page asks: the list, a
trial's curves, and its 3-D view, which has to have drawn the step.
"""

import json
import os
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from websockets.sync.client import connect

from app.bench.review_page import N_SCRUBS, bench_page
from app.bench.served import Served, running
from app.core import UserInput, preset
from app.errors import AppError
from app.recording.cache import cache_path
from app.recording.store import open_session
from app.recording.writer import TrialWriter
from app.robot.scene_file import load_scene
from app.session.header import TrialIdentity
from app.session.physics_world import PhysicsWorld
from app.session.trial import Trial

N_TRIALS = 50
N_SEEKS = 200
WARM_TRIALS = 10
"""Opened before memory is looked at first: caches fill at first."""
PATIENCE_S = 600.0
CIRCLE_STEPS = 400
_MARK = 'name="hindsight-session" content="'

Figures = dict[str, dict[str, Any]]


class ReviewBenchError(AppError):
    """What was asked of the bench makes no sense, or the review did not answer."""


def bench_review(
    minutes: float = 10.0, n_trials: int = N_TRIALS, n_scrubs: int = N_SCRUBS
) -> Figures:
    """Record a long trial, and open it again and again.

    Args:
        minutes: How long the trial is.
        n_trials: How many trials of this length are opened in a row.
        n_scrubs: How many moments are gone to in the page.

    Returns:
        "first_open": where the cache has yet to be made [s]; "open": from the cache [s]; "seek":
        from a wish to the step drawn by the server [ms]; "memory": of the server and its worker,
        after the first few trials and after the last [MB]; and in a browser, where there is one,
        "page_open" [s] and "page_scrub" [ms].

    Raises:
        ReviewBenchError: If a number is out of range, or the review gave no answer.
    """
    if not 0.05 <= minutes <= 120:
        raise ReviewBenchError(f"minutes is {minutes:g}; valid: 0.05 to 120")
    with tempfile.TemporaryDirectory() as root:
        _tell(f"recording a trial of {minutes:g} minutes …")
        log = record_long(Path(root), round(6000 * minutes))
        fresh, *trials = _repeat(log, n_trials + 1)
        command = ["review", root, "--port", "0"]
        with running(command) as server:
            ids = [path.relative_to(root).as_posix() for path in (log, fresh, *trials)]
            figures = _measure(server, Path(root), *ids)
            return figures | bench_page(server.url, ids[2:], n_scrubs)


def record_long(root: Path, n_steps: int) -> Path:
    """A log of the real physics, in which the hand is led in circles.

    Raises:
        ReviewBenchError: If it cannot be written.
    """
    settings = preset("default", method="direct")
    trial = Trial(
        PhysicsWorld(load_scene("default"), 1),
        settings,
        "glass",
        seed=1,
        identity=TrialIdentity(study="bench", participant="p01"),
        start_delay_s=0.1,
        timeout_s=0.0,
        wall_s=time.time(),
    )
    writer = TrialWriter(open_session(root, "bench", "p01", "1"), trial.header())
    for step in range(n_steps):
        angle = 2.0 * np.pi * step / CIRCLE_STEPS
        push = 0.3 if step // CIRCLE_STEPS % 3 else 0.0
        axes = (0.0, 0.0, push * float(np.cos(angle)), push * float(np.sin(angle)))
        writer.write(trial.step(UserInput(axes=axes, device="bench", sequence=step)))
        for event in trial.take_events():
            writer.write_event(event)
    path = writer.close(trial.summary(time.time()))
    writer.join()  # its cache is there from now on
    if path is None:
        raise ReviewBenchError(f"the trial could not be recorded: {writer.error}")
    return path


def _repeat(log: Path, count: int) -> list[Path]:
    """The same trial under other names: other trials to the review, but no more disk."""
    paths = []
    for number in range(2, count + 2):
        path = log.with_name(f"trial-{number:03d}.mcap")
        os.link(log, path)
        os.link(cache_path(log), cache_path(path))
        paths.append(path)
    return paths


def _measure(server: Served, root: Path, first: str, fresh: str, *trials: str) -> Figures:
    with _Page(server.url) as page:
        page.wait_for_pictures(2 + len(trials))
        page.open(first)  # the worker draws its first scene
        cache_path(root / fresh).unlink()  # only now, or the list's pictures would make it anew
        _tell("opening a trial without its cache …")
        first_open_s, reports = page.open(fresh)
        opened, memory = [], []
        for number, trial in enumerate(trials):
            opened.append(page.open(trial)[0])
            if number + 1 >= min(WARM_TRIALS, len(trials)):
                memory.append(server.usage().memory_bytes / 1e6)
        _tell(f"opened {len(trials)} trials; seeking …")
        seeks = page.seek_about(N_SEEKS)
    return {
        "first_open": {"median": round(first_open_s, 3), "reports": reports, "unit": "s"},
        "open": _figure(opened, "s"),
        "seek": _figure([1e3 * each for each in seeks], "ms"),
        "memory": {"first": round(memory[0], 1), "last": round(memory[-1], 1), "unit": "MB"},
    }


def _figure(values: list[float], unit: str) -> dict[str, Any]:
    median, p95, p99 = np.percentile(values, [50, 95, 99])
    return {
        "median": round(float(median), 3),
        "p95": round(float(p95), 3),
        "p99": round(float(p99), 3),
        "unit": unit,
    }


class _Page:
    """A browser's stand-in: asks as the page does."""

    def __init__(self, url: str) -> None:
        self._url = url
        with urllib.request.urlopen(f"{url}/review", timeout=PATIENCE_S) as answer:
            self._cookie = str(answer.headers["set-cookie"]).split(";")[0]
            session = answer.read().decode().split(_MARK)[1].split('"')[0]
        self._socket = connect(
            f"{url.replace('http', 'ws')}/review/socket/{session}",
            origin=url,  # pyright: ignore[reportArgumentType]
            additional_headers={"Cookie": self._cookie},
            compression=None,
            max_queue=None,  # it is not read while the list and the curves are waited for
            max_size=None,
            proxy=None,
        )
        self._number, self._trial, self._n_steps = 0, "", 0
        self._until(lambda message: message["type"] == "hello")

    def __enter__(self) -> "_Page":
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def wait_for_pictures(self, count: int) -> None:
        """Until the list has so many small pictures: nothing else is going on then."""
        with _deadline("the list") as in_time:
            while in_time():
                _, body = self._get("/api/review/trials")
                if sum(row.get("path") is not None for row in json.loads(body)["trials"]) >= count:
                    return
                time.sleep(0.1)

    def open(self, trial: str) -> tuple[float, int]:
        """How long it takes until curves and first step are there [s], and reports of progress."""
        start, reports = time.perf_counter(), 0
        status, body = self._get(f"/api/review/trial/{trial}/signals")
        while status == 202:
            reports += 1
            time.sleep(0.05)
            status, body = self._get(f"/api/review/jobs/{json.loads(body)['job']}")
        (length,) = np.frombuffer(body[:4], dtype="<u4")
        self._n_steps = int(json.loads(body[4 : 4 + int(length)])["n_steps"])
        self._number += 1
        ask = {"type": "command", "id": self._number, "name": "open", "trial": trial}
        self._socket.send(json.dumps(ask))
        self._until(lambda m: m["type"] == "status" and m["trial"] == [trial])
        return time.perf_counter() - start, reports

    def seek_about(self, count: int) -> list[float]:
        """How long each of so many jumps takes until its step is drawn [s]."""
        taken = []
        for step in np.random.default_rng(0).permutation(self._n_steps)[:count].tolist():
            start = time.perf_counter()
            self._socket.send(json.dumps({"type": "seek", "step": step}))
            self._until(lambda m, want=step: m["type"] == "status" and m["drawn"] == [want])
            taken.append(time.perf_counter() - start)
        return taken

    def _until(self, right: Any) -> None:
        with _deadline("the view") as in_time:
            while in_time():
                message = json.loads(self._socket.recv(PATIENCE_S))
                if message["type"] == "ack" and message["error"]:
                    raise ReviewBenchError(message["error"])
                if right(message):
                    return

    def _get(self, path: str) -> tuple[int, bytes]:
        request = urllib.request.Request(self._url + path, headers={"Cookie": self._cookie})
        with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
            return answer.status, answer.read()


@contextmanager
def _deadline(what: str) -> Iterator[Any]:
    end = time.monotonic() + PATIENCE_S

    def in_time() -> bool:
        if time.monotonic() > end:
            raise ReviewBenchError(f"{what} gave no answer within {PATIENCE_S:g} s")
        return True

    yield in_time


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
