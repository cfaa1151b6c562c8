"""A real web process in a thread of the test, with stand-in workers."""

import contextlib
import json
import re
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import httpx
import pytest
from starlette.applications import Starlette
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from app.web.config import ServerConfig
from app.web.run import HindsightServer, bind
from app.web.sessions import SessionRegistry
from app.web.viewer_page import subprotocol

WAIT_S = 120.0
"""How long a test waits for something that must happen; no limit of speed."""


def wait_until(what: Callable[[], Any]) -> Any:
    """Wait until `what()` is true, and return it."""
    deadline = time.monotonic() + WAIT_S
    while time.monotonic() < deadline:
        value = what()
        if value:
            return value
        time.sleep(0.02)
    raise AssertionError("it did not happen")


class Page:
    """An open input socket of a page, with its messages sorted by type."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.hello: dict[str, Any] = {}
        self.seen: list[dict[str, Any]] = []

    def send(self, **message: Any) -> None:
        self.socket.send(json.dumps(message))

    def next(self, kind: str, **fields: Any) -> dict[str, Any]:
        """The next message of this type that has these fields."""
        deadline = time.monotonic() + WAIT_S
        while True:
            message = json.loads(self.socket.recv(max(0.0, deadline - time.monotonic())))
            self.seen.append(message)
            if message["type"] == kind and fields.items() <= message.items():
                return message

    def status_where(self, right: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """The next status that is right."""
        while not right(status := self.next("status")):
            pass
        return status

    def command(self, number: int, name: str, **fields: Any) -> dict[str, Any]:
        """Send a command and return its ack."""
        self.send(type="command", id=number, name=name, **fields)
        return self.next("ack", id=number)

    def push(self, sequence: int, **fields: Any) -> None:
        """Send an input message."""
        message = {"seq": sequence, "t": 1000.0 + sequence, "left": [0, 0], "right": [0, 0]}
        self.send(type="input", **{**message, **fields})


@dataclass
class Browser:
    """A browser with its own cookies."""

    server: "Server"
    http: httpx.Client
    session: str = ""
    stack: contextlib.ExitStack = field(default_factory=contextlib.ExitStack)

    def open(self) -> str:
        """Fetch the page; returns the session's id."""
        answer = self.http.get("/")
        assert answer.status_code == 200, answer.text
        found = re.search(r'<meta name="hindsight-session" content="(\w+)">', answer.text)
        assert found, answer.text
        self.session = found[1]
        return self.session

    @property
    def cookie(self) -> str:
        return "; ".join(f"{name}={value}" for name, value in self.http.cookies.items())

    def socket(self, path: str, **options: Any) -> ClientConnection:
        """A websocket as this browser opens it."""
        headers = {"Cookie": self.cookie} if self.http.cookies else {}
        options = {"origin": self.server.url, "additional_headers": headers, **options}
        url = self.server.url.replace("http://", "ws://") + path
        quiet: dict[str, Any] = {"compression": None, "max_size": None, "proxy": None}
        quiet["close_timeout"] = 0.5  # a test leaves much unread
        socket = connect(url, **quiet, **options)
        self.stack.callback(socket.close)
        return socket

    def page(self) -> Page:
        """Open the page and its input socket, and wait for hello."""
        page = self.dial()
        page.hello = page.next("hello")
        return page

    def dial(self) -> Page:
        """Open the page's input socket."""
        if not self.session:
            self.open()
        return Page(self.socket(f"/input/{self.session}"))

    def viewer(self, **options: Any) -> ClientConnection:
        """Open the viewer's socket."""
        names = [Subprotocol(subprotocol())]
        return self.socket(f"/view/{self.session}", subprotocols=names, **options)


@dataclass
class Server:
    """The web process under test."""

    url: str
    app: Starlette
    stack: contextlib.ExitStack
    stop: Callable[[], None]

    def browser(self) -> Browser:
        """A browser of its own; closed with the test."""
        http = self.stack.enter_context(httpx.Client(base_url=self.url, trust_env=False))
        browser = Browser(self, http)
        self.stack.callback(browser.stack.close)
        return browser

    @property
    def registry(self) -> SessionRegistry:
        """The sessions inside the process."""
        return self.app.state.registry

    def pid_of(self, session_id: str) -> int:
        """Process of a session's worker."""
        session = self.registry.by_id(session_id)
        assert session and session.worker
        return session.worker.pid

    def health(self) -> dict[str, Any]:
        """What the health report says."""
        return httpx.get(self.url + "/api/health", trust_env=False).json()


StartServer = Callable[..., Server]


@pytest.fixture
def start_server(tmp_path: Path) -> Iterator[StartServer]:
    """Start a server with these changes to the test configuration."""
    base = ServerConfig(
        port=0,
        sessions=tmp_path / "sessions",
        worker_entry="tests.web.standin:main",
        preload=("viser",),
        starts_per_s=50.0,
        end_grace_s=5.0,
        capacity=4,
    )
    with contextlib.ExitStack() as stack:

        def start(**changes: Any) -> Server:
            config = replace(base, **changes)
            listener = stack.enter_context(bind(config))
            server = HindsightServer(config)
            thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
            thread.start()

            def stop() -> None:
                server.should_exit = True
                thread.join()

            stack.callback(stop)
            wait_until(lambda: server.started or not thread.is_alive())
            assert server.started
            port = listener.getsockname()[1]
            return Server(f"http://127.0.0.1:{port}", server.application, stack, stop)

        yield start


@pytest.fixture
def server(start_server: StartServer) -> Server:
    """A server with the test configuration."""
    return start_server()
