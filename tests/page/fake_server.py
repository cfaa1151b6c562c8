"""A small stand-in for the server: the page's files, its websocket, and a viewer that only stands.

It speaks the browser's side of docs/architecture.md, keeps every message it was sent, and does what
a test tells it: other statuses, notices, refused commands, dropped lines.
"""

import asyncio
import contextlib
import copy
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

ROOT = Path(__file__).parents[2]
STATIC = ROOT / "static"
SESSION = "test-session"
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; frame-src 'self'; base-uri 'none'"
)
STATUS_PERIOD_S = 1 / 30

VIEWER = Path(__file__).with_name("viewer.html").read_text()

HELLO: dict[str, Any] = {
    "type": "hello",
    "session": SESSION,
    "version": "0.0",
    "control": True,
    "view": f"/view/{SESSION}/",
    "scene": {
        "name": "default",
        "objects": [{"name": name, "colour": name} for name in ("canteen", "block", "glass")],
    },
    "scenes": ["default", "clutter", "in_line"],
    "recorded": True,
    "hold_on_loss": False,
    "run": 1,
    "watch": "/watch/abc",
    "methods": ["direct", "blend", "policy", "yielding", "autonomy"],
    "settings": {
        "method": "policy",
        "enabled": True,
        "gain": 1.0,
        "arbitration": "distance",
        "arbitration_distance": 0.2,
        "predictor": "calibrated",
        "step": "exact",
        "magnitude": "free",
        "full_stick_speed": 0.2,
        "max_speed": 0.4,
        "w_f": "inf",
        "w_l": 20.0,
    },
    "layers": {
        "user": True,
        "assist": True,
        "ghosts": True,
        "tags": True,
        "path": False,
        "slice": True,
        "slice_of": "belief",
        "slice_plane": "hand",
    },
}
TRIAL: dict[str, Any] = {
    "number": 1,
    "target": "glass",
    "method": "policy",
    "shown_as": "",
    "phase": "running",
    "outcome": "running",
    "seconds": 14.2,
    "input": 5.8,
    "grasped": "",
    "scene": "default",
    "seed": 7,
    "simulated": False,
}
STATUS: dict[str, Any] = {
    "type": "status",
    "trial": TRIAL,
    "belief": {"canteen": 0.09, "block": 0.19, "glass": 0.72},
    "hand": [0.41, 0.02, 0.21],
    "hand_quaternion": [1, 0, 0, 0],
    "objects": {
        "canteen": [0.62, 0.2, 0.09],
        "block": [0.52, 0.0, 0.06],
        "glass": [0.45, -0.2, 0.06],
    },
    "direct": [0] * 6,
    "assistance": [0] * 6,
    "executed": [0] * 6,
    "assist_stick": {"left": [0, 0], "right": [0.4, -0.5]},
    "sticks": {"left": [0, 0], "right": [0, 0], "mode": "translate", "yaw": 0.0},
    "loss": "",
    "loop": {"hz": 100.0, "late": 0, "lateness_ms": 0.0},
    "settings": HELLO["settings"],
    "settings_id": 1,
    "layers": HELLO["layers"],
    "camera": "operator",
    "value_range": [0.2, 1.4],
    "leading_target": "glass",
    "reason": {
        "canteen": "you moved away from it",
        "block": "you turned away from it",
        "glass": "you push toward it",
    },
}


class FakeServer:
    """What the tests see: messages received, and levers for what is sent."""

    def __init__(self) -> None:
        self.url = ""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._sockets: set[WebSocket] = set()
        self.reset()

    def reset(self) -> None:
        """Forget what happened; the next page meets a fresh session."""
        self.hello = copy.deepcopy(HELLO)
        self.status = copy.deepcopy(STATUS)
        self.received: list[dict[str, Any]] = []
        self.objections: dict[str, str] = {}
        self.refuse = False
        self.connections = 0

    @property
    def pages(self) -> int:
        """Pages that were greeted and are still there."""
        return len(self._sockets)

    def of_type(self, kind: str) -> list[dict[str, Any]]:
        """Messages of one type, oldest first."""
        return [message for message in list(self.received) if message["type"] == kind]

    def commands(self) -> list[tuple[str, dict[str, Any]]]:
        """Name and fields of each command but the theme's, oldest first."""
        told = [m for m in self.of_type("command") if m["name"] != "theme"]
        return [
            (m["name"], {k: v for k, v in m.items() if k not in ("type", "id", "name")})
            for m in told
        ]

    def wait(self, true: Callable[[], Any], what: str, timeout_s: float = 20.0) -> Any:
        """Wait until `true()` is; the wait's end is a failure, not a measurement."""
        ends = time.monotonic() + timeout_s
        while time.monotonic() < ends:
            if value := true():
                return value
            time.sleep(0.01)
        raise AssertionError(f"{what}: not within {timeout_s} s; newest: {self.received[-3:]}")

    def send(self, message: dict[str, Any]) -> None:
        """Say something to every open page."""
        for socket in list(self._sockets):
            self._run(socket.send_json(message))

    def drop(self, code: int = 1001, reason: str = "") -> None:
        """Close every line."""
        for socket in list(self._sockets):
            self._run(socket.close(code, reason))

    def _run(self, coroutine: Any) -> None:
        assert self._loop is not None
        asyncio.run_coroutine_threadsafe(coroutine, self._loop).result(10)

    async def page(self, request: Request) -> Response:
        """The page with its session filled in, under a policy that allows nothing inline."""
        text = (STATIC / "index.html").read_text()
        slot = '<meta name="hindsight-session" content="">'
        assert slot in text
        text = text.replace(slot, slot.replace('""', f'"{SESSION}"'))
        return HTMLResponse(text, headers={"content-security-policy": POLICY})

    async def viewer(self, request: Request) -> Response:
        """A viewer with a camera and three tags."""
        return HTMLResponse(VIEWER)

    async def input(self, socket: WebSocket) -> None:
        """The page's websocket."""
        self._loop = asyncio.get_running_loop()
        if self.refuse:
            await socket.close(1013)
            return
        await socket.accept()
        self.connections += 1
        await socket.send_json(self.hello)
        self._sockets.add(socket)
        sender = asyncio.create_task(self._tell(socket))
        try:
            while True:
                message = await socket.receive_json()
                await self._answer(socket, message)  # looked up now: a test may have replaced it
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            self._sockets.discard(socket)
            sender.cancel()

    async def _tell(self, socket: WebSocket) -> None:
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while True:
                await socket.send_json(self.status)
                await asyncio.sleep(STATUS_PERIOD_S)

    async def _answer(self, socket: WebSocket, message: dict[str, Any]) -> None:
        self.received.append(message)
        if message["type"] == "ping":
            await socket.send_json({"type": "pong", "t": message["t"]})
        if message["type"] == "command":
            error = self.objections.get(message["name"])
            if error is None:
                self._carry_out(message)
            await socket.send_json({"type": "ack", "id": message["id"], "error": error})

    def _carry_out(self, message: dict[str, Any]) -> None:
        trial = self.status["trial"]
        if message["name"] == "method":
            trial["method"] = message["method"]
        elif message["name"] == "assist":
            self.status["settings"] = {**self.status["settings"], "enabled": message["enabled"]}
        elif message["name"] in ("settings", "layers"):
            key = message["name"]
            self.status[key] = {**self.status[key], **message["changes"]}
        elif message["name"] == "camera" and message["preset"] != "reset":
            self.status["camera"] = message["preset"]
        elif message["name"] == "new-trial":
            self.status["trial"] = {
                **trial,
                **{k: message[k] for k in ("target", "seed", "method", "scene") if k in message},
                "number": trial["number"] + 1,
                "outcome": "running",
                "phase": "running",
                "grasped": "",
                "seconds": 0.0,
                "input": 0.0,
            }


@contextlib.contextmanager
def fake_server() -> Iterator[FakeServer]:
    """A running stand-in on a free port of this machine."""
    fake = FakeServer()
    app = Starlette(
        routes=[
            Route("/", fake.page),
            Route("/view/{session}/", fake.viewer),
            WebSocketRoute("/input/{session}", fake.input),
            Mount("/static", StaticFiles(directory=STATIC)),
        ]
    )
    server = uvicorn.Server(
        uvicorn.Config(app, host="127.0.0.1", port=0, log_level="error", ws="websockets-sansio")
    )
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    fake.wait(lambda: server.started, "the stand-in starts")
    fake.url = f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    try:
        yield fake
    finally:
        server.should_exit = True
        thread.join(10)
