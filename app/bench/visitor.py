"""A browser's stand-in that steers: a page and a viewer, over the same sockets as a real one."""

import asyncio
import contextlib
import json
import math
import re
import time
import urllib.request
from typing import Any

import viser
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Origin, Subprotocol

from app.errors import AppError

INPUT_HZ = 60.0
TURN_S = 4.0
"""The right stick goes round once in this time [s]."""
PUSH, LIFT = 0.6, 0.15
"""How far the sticks are pushed: round, and up and down with half the frequency."""
_SESSION = re.compile(r'<meta name="hindsight-session" content="(\w+)">')


class VisitError(AppError):
    """The server did not let a visitor in, or sent one away."""


class Visitor:
    """Opens a session, pushes the sticks in circles, watches the 3-D view, starts trials anew.

    Attributes:
        session: The session's id.
        viewer_bytes: Payload of the frames that the viewer's socket has brought.
        statuses: Status messages received.
        trials: Trials begun after the first.
        complaint: Why it was sent away; empty: it was not.
    """

    def __init__(self, url: str) -> None:
        """Prepare; nothing is sent before `open`.

        Args:
            url: The server's address, such as http://127.0.0.1:8080.
        """
        self._url = url
        self._cookie = ""
        self._tasks: list[asyncio.Task[None]] = []
        self._sockets: list[ClientConnection] = []
        self._over = False
        self.session = ""
        self.viewer_bytes = self.statuses = self.trials = 0
        self.complaint = ""

    async def open(self) -> None:
        """Come in and begin to steer; returns when the first status has arrived.

        Raises:
            VisitError: If the server refuses.
        """
        await asyncio.to_thread(self._fetch)
        page = await self._connect(f"/input/{self.session}")
        await self._wait_for(page, "hello")
        viewer = await self._connect(f"/view/{self.session}", f"viser-v{viser.__version__}")
        await self._wait_for(page, "status")
        for job in (self._watch(viewer), self._listen(page), self._steer(page)):
            self._tasks.append(asyncio.create_task(job))

    async def close(self) -> None:
        """Leave."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        for socket in self._sockets:
            with contextlib.suppress(ConnectionClosed, TimeoutError):
                await asyncio.wait_for(socket.close(), 2.0)

    def _fetch(self) -> None:
        direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with direct.open(self._url + "/", timeout=30) as answer:
                text = answer.read().decode()
                self._cookie = (answer.headers.get("set-cookie") or "").split(";")[0]
        except OSError as error:
            raise VisitError(f"the server lets nobody in: {error}") from None
        found = _SESSION.search(text)
        if not found:
            raise VisitError("the server's page names no session")
        self.session = found[1]

    async def _connect(self, path: str, protocol: str = "") -> ClientConnection:
        socket = await connect(
            self._url.replace("http", "ws", 1) + path,
            origin=Origin(self._url),
            subprotocols=[Subprotocol(protocol)] if protocol else None,
            additional_headers={"Cookie": self._cookie},
            compression=None,
            max_size=None,
            proxy=None,
            open_timeout=60,
        )
        self._sockets.append(socket)
        return socket

    async def _wait_for(self, page: ClientConnection, kind: str) -> dict[str, Any]:
        try:
            async with asyncio.timeout(180):
                async for text in page:
                    message = json.loads(text)
                    if message["type"] == "ended":
                        raise VisitError(f"a session ended: {message['reason']}")
                    if message["type"] == kind:
                        return message
        except TimeoutError:
            raise VisitError(f"a session sends no {kind}") from None
        raise VisitError(f"a session closed its socket before it sent {kind}")

    async def _watch(self, viewer: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for frame in viewer:
                self.viewer_bytes += len(frame)

    async def _listen(self, page: ClientConnection) -> None:
        """Only the outcome matters: it is looked for in the text, as the rest need not be read."""
        with contextlib.suppress(ConnectionClosed):
            async for text in page:
                if '"type":"status"' in str(text[:40]):
                    self.statuses += 1
                    self._over = '"outcome":"running"' not in str(text)
                elif '"ended"' in str(text):
                    self.complaint = str(json.loads(text).get("reason", ""))

    async def _steer(self, page: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            begin = due = time.monotonic()
            number, asked_s = 0, begin
            while True:
                number += 1
                now = time.monotonic()
                await page.send(json.dumps(_input(number, now - begin)))
                if number % round(INPUT_HZ) == 0:
                    await page.send(json.dumps({"type": "ping", "t": now * 1e3}))
                if self._over and now - asked_s > 1.0:
                    asked_s, self.trials = now, self.trials + 1
                    command = {"type": "command", "id": self.trials, "name": "new-trial"}
                    await page.send(json.dumps(command))
                due = max(due + 1.0 / INPUT_HZ, now)
                await asyncio.sleep(due - now)


def _input(number: int, seconds: float) -> dict[str, Any]:
    angle = 2.0 * math.pi * seconds / TURN_S
    return {
        "type": "input",
        "seq": number,
        "t": time.monotonic() * 1e3,
        "left": [0.0, LIFT * math.sin(angle / 2.0)],
        "right": [PUSH * math.cos(angle), PUSH * math.sin(angle)],
        "device": "pointer",
    }
