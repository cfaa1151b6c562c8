"""The worker that draws: the newest seek counts, commands are answered, a bad wish ends nothing."""

import gc
import json
import threading
import time
import weakref
from typing import Any

import numpy as np
import pytest
from websockets.sync.client import ClientConnection

from app.recording.reader import read_trial
from app.review.desk import Desk
from app.review.replay import Replay
from app.review.view import ReviewView
from app.session.view_server import view_server
from tests.review.conftest import PATIENCE_S, Logs, Review


class Page:
    """The page's end of the socket."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.number = 0

    def next(self, kind: str, right: Any = lambda message: True) -> dict[str, Any]:
        """The next message of this type that is right."""
        deadline = time.monotonic() + PATIENCE_S
        while True:
            message = json.loads(self.socket.recv(max(0.1, deadline - time.monotonic())))
            if message["type"] == kind and right(message):
                return message

    def send(self, **message: Any) -> None:
        self.socket.send(json.dumps(message))

    def command(self, name: str, **fields: Any) -> str | None:
        """Send a command; what was wrong with it, or None."""
        self.number += 1
        self.send(type="command", id=self.number, name=name, **fields)
        return self.next("ack", lambda ack: ack["id"] == self.number)["error"]


def test_of_many_seeks_the_newest_is_taken():
    """What waits at the desk is one step for each view; commands keep their order."""
    desk = Desk()
    for step in range(1000):
        desk.put({"type": "seek", "view": step % 2, "step": step})
    desk.put({"type": "command", "name": "open"})
    desk.put({"type": "command", "name": "theme"})
    desk.put({"type": "seek", "view": 0, "step": "nonsense"})
    work = desk.take(0.0)
    assert work.seeks == {0: 998, 1: 999}
    assert [command["name"] for command in work.commands] == ["open", "theme"]
    empty = desk.take(0.0)
    assert empty.seeks == {} and empty.commands == []


def test_waiting_ends_with_what_comes():
    """A seek, or the end, wakes the worker at once."""
    desk = Desk()
    waker = threading.Timer(0.05, lambda: desk.put({"type": "seek", "view": 0, "step": 7}))
    waker.start()
    assert desk.take(PATIENCE_S).seeks == {0: 7}
    waker.join()
    desk.disconnect()
    assert desk.take(PATIENCE_S).seeks == {} and "gone" in desk.ended


def test_the_view_draws_the_logged_step(logs: Logs):
    """Joints, objects and path are those of the log, forwards and backwards."""
    with view_server() as server:
        view = ReviewView(server, "dark", {"slice": False, "path": True})
        view.open(str(logs.path(logs.glass)))
        log = read_trial(logs.path(logs.glass))
        for step in (0, 200, 50, 10_000):
            view.draw(step)
            assert view.step == min(step, log.n_steps - 1)
        assert view.moment == {}
        view.draw(100)
        assert set(view.moment) >= {"direct", "blend", "policy"}
        given = log.steps["direct_twist"][100]
        assert np.array(view.moment["direct"]) == pytest.approx(given)
        view.close()


def test_a_page_opens_seeks_and_is_answered(review: Review, logs: Logs):
    """The last of many seeks is what is drawn; wrong wishes are answered and change nothing."""
    page = Page(review.socket())
    assert len(page.next("hello")["views"]) == 1
    assert page.command("open", trial=logs.glass) is None
    last = read_trial(logs.path(logs.glass)).n_steps - 3
    for step in range(0, last + 1, 2):
        page.send(type="seek", step=step)
    page.send(type="seek", step=last)
    status = page.next("status", lambda message: message["drawn"] == [last])
    assert status["trial"] == [logs.glass]
    assert "no trial" in str(page.command("open", trial="nowhere.mcap"))
    assert "no trial's id" in str(page.command("open", trial="../x.mcap"))
    assert "view is 3" in str(page.command("open", view=3, trial=logs.block))
    assert "unknown" in str(page.command("explode"))
    assert "valid" in str(page.command("layers", changes={"ghosts": "maybe"}))
    page.send(type="nonsense")
    assert "no message" in page.next("error")["text"]
    assert page.command("layers", changes={"slice": False}) is None
    status = page.next("status", lambda message: message["layers"]["slice"] is False)
    assert status["drawn"] == [last] and status["trial"] == [logs.glass]
    assert page.command("views", count=2) is None
    assert page.command("open", view=1, trial=logs.block) is None
    page.send(type="seek", step=5, view=1)
    page.next("status", lambda message: message["drawn"] == [last, 5])
    page.socket.close()


def test_memory_stays_flat_over_many_trials(logs: Logs):
    """Fifty trials opened in a row leave one behind, not fifty."""
    opened: list[weakref.ref[Replay]] = []
    with view_server() as server:
        view = ReviewView(server, "dark", {"slice": False})
        for number in range(50):
            view.open(str(logs.path((logs.glass, logs.block)[number % 2])))
            assert view.replay is not None
            opened.append(weakref.ref(view.replay))
        gc.collect()
        assert [kept() for kept in opened if kept() is not None] == [view.replay]
        view.close()
