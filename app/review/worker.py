"""What one process runs for one review page: its 3-D views, moved through trials as asked.

The boundary is that of live sessions (docs/architecture.md); commands and seeks are its own.
"""

import contextlib
import logging
import os
import signal
import socket
import time
from typing import Any

from app.errors import AppError
from app.review.desk import Desk
from app.review.errors import ReviewError
from app.review.view import ReviewView
from app.session.channel import Channel, Message
from app.session.spec import WorkerSpec
from app.session.view_server import view_server

MAX_VIEWS = 4
HEARTBEAT_S = 1.0
"""How often a worker that has nothing to do says that it lives [s]."""
FIRST_LAYERS = {"path": True}

logger = logging.getLogger("hindsight.review")


def main(spec: WorkerSpec, sock: socket.socket) -> None:
    """Draw what is asked until told to end, the socket closes, or SIGTERM comes.

    Args:
        spec: Which page; its options may say theme and layers.
        sock: This end of the socket pair to the web process.
    """
    desk = Desk()
    channel = Channel(sock, desk.put, desk.disconnect)
    signal.signal(signal.SIGTERM, lambda *_: desk.end_soon("The server was stopped."))
    reason = "The review failed."
    try:
        channel.start()
        with contextlib.ExitStack() as stack:
            Worker(channel, desk, stack).run()
        reason = desk.ended
    except Exception:
        logger.exception("review %s failed", spec.id)
    finally:
        channel.send({"type": "ended", "reason": reason})
        channel.close()


class Worker:
    """Owns the views; all drawing happens in one thread."""

    def __init__(self, channel: Channel, desk: Desk, stack: contextlib.ExitStack) -> None:
        """Open the first view.

        Args:
            channel: To the web process.
            desk: What it asks for.
            stack: Closes the views at the end.
        """
        self._channel, self._desk, self._stack = channel, desk, stack
        self._views: list[ReviewView] = []
        self._theme = "dark"
        self._layers: dict[str, Any] = dict(FIRST_LAYERS)
        self._camera = "operator"
        self._detail = "full"
        self._add_view()

    def run(self) -> None:
        """Serve until the end is asked for."""
        ports = [view.server.get_port() for view in self._views]
        self._channel.send(
            {"type": "ready", "viewer_port": ports[0], "pid": os.getpid(), "hello": self._hello()}
        )
        while not self._desk.ended:
            work = self._desk.take(HEARTBEAT_S)
            for message in work.commands:
                self._obey(message)
            for index, step in work.seeks.items():
                if 0 <= index < len(self._views):
                    self._draw(index, step)
            self._channel.send_status(self._status())

    def _obey(self, message: Message) -> None:
        """Carry out one command and answer it."""
        error: str | None = None
        try:
            self._act(str(message.get("name")), message)
        except AppError as refusal:
            error = str(refusal)
        except Exception as failure:  # a log may hold anything: the other views live on
            logger.exception("a command of the review failed")
            error = f"that failed: {type(failure).__name__}: {failure}"
        ack = {"type": "ack", "id": message.get("id"), "client": message.get("client")}
        self._channel.send({**ack, "error": error})

    def _act(self, name: str, message: Message) -> None:
        if name == "views":
            count = message.get("count")
            if type(count) is not int or not 1 <= count <= MAX_VIEWS:
                raise ReviewError(f"views: count is {count!r}; valid: 1 to {MAX_VIEWS}")
            while len(self._views) < count:
                self._add_view()
            self._channel.send({"type": "hello", **self._hello()})
        elif name == "open":
            view = self._view(message)
            view.open(str(message.get("path")))
            view.trial_id = str(message.get("trial", ""))
        elif name == "path":
            self._view(message).set_path(message.get("points") or [])
        elif name == "layers":
            changes = message.get("changes") or {}
            for view in self._views:
                view.set_layers(changes)
            self._layers.update(changes)
        elif name == "theme":
            for view in self._views:
                view.set_theme(str(message.get("theme")))
            self._theme = str(message.get("theme"))
        elif name == "detail":
            for view in self._views:
                view.set_detail(str(message.get("detail")))
            self._detail = str(message.get("detail"))
        elif name == "camera":
            for view in self._views:
                view.set_camera(str(message.get("preset")))
            self._camera = str(message.get("preset"))
        else:
            valid = "views, open, path, layers, theme, detail, camera"
            raise ReviewError(f"command {name!r} is unknown; valid: {valid}")

    def _view(self, message: Message) -> ReviewView:
        index = message.get("view", 0)
        if type(index) is not int or not 0 <= index < len(self._views):
            raise ReviewError(f"view is {index!r}; valid: 0 to {len(self._views) - 1}")
        return self._views[index]

    def _add_view(self) -> None:
        server = self._stack.enter_context(view_server())
        view = ReviewView(server, self._theme, self._layers)
        view.set_camera(self._camera)
        view.set_detail(self._detail)
        self._stack.callback(view.close)
        self._views.append(view)

    def _draw(self, index: int, step: int) -> None:
        try:
            self._views[index].draw(step)
        except Exception as error:  # one bad step shall not end the review
            logger.exception("step %d could not be drawn", step)
            text = f"Step {step} cannot be drawn: {error}"
            self._channel.send({"type": "notice", "level": "error", "text": text})

    def _hello(self) -> dict[str, Any]:
        return {"views": [view.server.get_port() for view in self._views]}

    def _status(self) -> dict[str, Any]:
        first = self._views[0]
        return {
            "type": "status",
            "drawn": [view.step for view in self._views],
            "trial": [view.trial_id for view in self._views],
            "moment": first.moment,
            "layers": first.layers,
            "value_range": first.value_range,
            "at": time.monotonic(),
        }
