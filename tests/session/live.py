"""A worker in a process of its own, and what the web process would say to it."""

import json
import multiprocessing
import socket
import threading
import time
from collections.abc import Callable
from multiprocessing import forkserver
from pathlib import Path
from typing import Any

from app.session.spec import WorkerSpec
from app.session.worker import main

Message = dict[str, Any]
PATIENCE_S = 120.0
"""Only ends a test that would hang."""


class Live:
    """A running worker with one page, c1, in control."""

    def __init__(
        self,
        sessions: Path,
        name: str = "live",
        scene: str = "default",
        entry: Callable[[WorkerSpec, socket.socket], None] = main,
        **options: Any,
    ):
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(["app.session.preload"])
        forkserver.ensure_running()
        settings = {"preset": "default", "method": "policy"}
        spec = WorkerSpec(name, scene, settings, str(sessions), options=options)
        self.folder = sessions / "demo" / "data" / "raw" / f"subject-{name}" / "session-1"
        self.sock, far = socket.socketpair()
        self.process = context.Process(target=entry, args=(spec, far), daemon=True)
        self.process.start()
        far.close()
        self.messages: list[Message] = []
        self.status: Message | None = None
        self._seq = 0
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.send({"type": "clients", "control": "c1", "count": 1})

    def _read(self) -> None:
        with self.sock.makefile("rb") as lines:
            try:
                for line in lines:
                    message = json.loads(line)
                    if message["type"] == "status":
                        self.status = message
                    else:
                        self.messages.append(message)
            except (OSError, ValueError):
                pass  # the worker was killed within a line

    def send(self, message: Message) -> None:
        """Send a message to the worker."""
        self.sock.sendall(json.dumps(message).encode() + b"\n")

    def push(self, left: tuple[float, float], right: tuple[float, float]) -> None:
        """One input message of the page."""
        self._seq += 1
        sticks = {"left": left, "right": right, "mode": "translate", "yaw": 0.0, "dead_zone": 0.1}
        stamp = {"seq": self._seq, "t": time.monotonic() * 1000, "device": "pointer"}
        self.send({"type": "input", "client": "c1", **sticks, **stamp})

    def command(self, number: int, name: str, **fields: Any) -> Message:
        """Send a command and wait for its ack."""
        self.send({"type": "command", "client": "c1", "id": number, "name": name, **fields})
        return self.wait("ack", lambda m: m["id"] == number)

    def wait(self, kind: str, matches: Callable[[Message], bool] = lambda _: True) -> Message:
        """The first message of this kind that matches."""
        found: list[Message] = []

        def look() -> bool:
            found[:] = [m for m in self.messages if m["type"] == kind and matches(m)]
            return bool(found)

        self.until(look)
        return found[0]

    def until(self, condition: Callable[[], bool]) -> None:
        """Wait; a worker that has died meanwhile fails the test."""
        deadline = time.monotonic() + PATIENCE_S
        while not condition():
            alive = self.process.is_alive() or self._reader.is_alive()
            assert alive and time.monotonic() < deadline, (self.messages[-3:], self.status)
            time.sleep(0.005)

    def status_where(self, condition: Callable[[Message], bool]) -> Message:
        """The first status that meets a condition."""
        self.until(lambda: self.status is not None and condition(self.status))
        assert self.status is not None
        return self.status

    def finish(self) -> int | None:
        """Wait for the process; its exit code."""
        self.process.join(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        return self.process.exitcode

    def close(self) -> None:
        """Leave nothing behind."""
        if self.process.is_alive():
            self.process.kill()
        self.process.join()
        self._reader.join()
        self.sock.close()
        self.process.close()
