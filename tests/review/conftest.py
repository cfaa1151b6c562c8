"""A folder of real and of broken logs, and the review's server in a thread of the test."""

import contextlib
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import httpx
import pytest
from mcap.writer import Writer
from websockets.sync.client import ClientConnection, connect

from app.recording.container import TrialEncoder
from app.recording.entry import index_of
from app.review.folder import ReviewFolder
from app.review.secret import Password
from app.review.server import create_review_app, review_config
from app.session.commands import Command
from app.session.trial import Trial
from app.web.run import HindsightServer, bind
from tests.recording.samples import make_header, make_step, make_summary
from tests.review.logs import record_trial

PATIENCE_S = 120.0
"""Only ends a test that would hang."""


def switch_and_rest(trial: Trial, tick: int) -> list[Command]:
    """Another method, other settings, assistance off and on, and the arm held for a moment."""
    wanted = {
        80: Command("method", {"method": "blend"}),
        110: Command("settings", {"changes": {"gain": 0.7}}),
        120: Command("assist", {"enabled": False}),
        130: Command("assist", {"enabled": True}),
        140: Command("hold"),
    }
    return [wanted[tick]] if tick in wanted and trial.phase == "running" else []


@dataclass(frozen=True)
class Logs:
    """Ids of the logs in the folder."""

    root: Path
    glass: str
    block: str
    canteen: str

    def path(self, trial_id: str) -> Path:
        """Where a log is."""
        return self.root / trial_id


@pytest.fixture(scope="session")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Logs:
    """Three trials that were really done; not to be changed."""
    root = tmp_path_factory.mktemp("review") / "sessions"
    glass = record_trial(root, "glass", seed=3, number=1, script=switch_and_rest)
    block = record_trial(root, "block", method="blend", seed=4, number=2, live=True)
    canteen = record_trial(
        root, "canteen", method="direct", seed=5, participant="p02", number=1, study="other"
    )
    folder = ReviewFolder(root)
    return Logs(folder.root, *(folder.id_of(path.resolve()) for path in (glass, block, canteen)))


@pytest.fixture
def copied(logs: Logs, tmp_path: Path) -> Logs:
    """The same in a folder that a test may change."""
    root = tmp_path / "sessions"
    shutil.copytree(logs.root, root)
    return Logs(root.resolve(), logs.glass, logs.block, logs.canteen)


def write_broken(logs: Logs) -> dict[str, str]:
    """Broken logs beside the good ones: id → what the list has to say."""
    good = logs.path(logs.glass)
    newer = TrialEncoder()
    header = make_header(schema_version=99)
    newer.add("trial", header, 0, 0)
    newer.add("step", make_step(0), 0, 0)
    newer.finish(index_of(header, make_summary()))
    files = {
        "trial-011.mcap": (good.read_bytes()[:-5000], "is torn"),
        "trial-012.mcap": (b"", "is empty"),
        "trial-013.mcap": (_foreign(), "without a Hindsight trial"),
        "trial-014.mcap": (b"time,x\n0,1\n", "is not an MCAP file"),
        "trial-015.mcap": (bytes(newer.buffer.waiting), "record format 99"),
    }
    found = {}
    for name, (content, problem) in files.items():
        path = good.with_name(name)
        path.write_bytes(content)
        found[path.relative_to(logs.root).as_posix()] = problem
    return found


def _foreign() -> bytes:
    stream = BytesIO()
    writer = Writer(stream)
    writer.start()
    schema = writer.register_schema("chatter", "jsonschema", b"{}")
    writer.add_message(writer.register_channel("/chatter", "json", schema), 0, b"{}", 0)
    writer.finish()
    return stream.getvalue()


@dataclass
class Review:
    """A running review, and a browser's session with it."""

    url: str
    http: httpx.Client
    stack: contextlib.ExitStack
    session: str = ""
    headers: dict[str, str] = field(default_factory=dict)

    def open_page(self) -> str:
        """Load the page, which gives the cookie; returns its text."""
        answer = self.http.get("/review")
        assert answer.status_code == 200, answer.text
        mark = 'name="hindsight-session" content="'
        self.session = answer.text.split(mark)[1].split('"')[0]
        self.headers = {"origin": self.url}
        return answer.text

    def trials(self) -> dict[str, dict[str, Any]]:
        """The list, by id."""
        return {row["id"]: row for row in self.http.get("/api/review/trials").json()["trials"]}

    def done(self, answer: httpx.Response, patience_s: float = PATIENCE_S) -> httpx.Response:
        """The answer once its computation is finished."""
        deadline = time.monotonic() + patience_s
        while answer.status_code == 202:
            assert time.monotonic() < deadline
            time.sleep(0.05)
            answer = self.http.get(f"/api/review/jobs/{answer.json()['job']}")
        return answer

    def act(self, method: str, path: str, body: Any = None) -> httpx.Response:
        """A request that changes or computes something, as the page sends it."""
        return self.done(self.http.request(method, path, json=body, headers=self.headers))

    def socket(self, **options: Any) -> ClientConnection:
        """The page's own websocket."""
        cookie = "; ".join(f"{name}={value}" for name, value in self.http.cookies.items())
        url = f"{self.url.replace('http', 'ws')}/review/socket/{self.session}"
        wanted = {"origin": self.url, "additional_headers": {"Cookie": cookie}, **options}
        socket = connect(url, proxy=None, compression=None, close_timeout=0.5, **wanted)
        self.stack.callback(socket.close)
        return socket


StartReview = Callable[..., Review]


@contextlib.contextmanager
def running_review(root: Path, password: Password | None = None) -> Iterator[Review]:
    """Serve a folder in a thread."""
    config = review_config(root, "127.0.0.1", 0, "")
    with contextlib.ExitStack() as stack:
        listener = stack.enter_context(bind(config))
        server = HindsightServer(config, create_review_app(config, ReviewFolder(root), password))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()

        def stop() -> None:
            server.should_exit = True
            thread.join()

        stack.callback(stop)
        deadline = time.monotonic() + PATIENCE_S
        while not server.started:
            assert thread.is_alive() and time.monotonic() < deadline
            time.sleep(0.02)
        url = f"http://127.0.0.1:{listener.getsockname()[1]}"
        http = stack.enter_context(httpx.Client(base_url=url, trust_env=False, timeout=60.0))
        yield Review(url, http, stack)


@pytest.fixture(scope="module")
def review(logs: Logs) -> Iterator[Review]:
    """A review of the real logs, its page loaded; for tests that change nothing."""
    with running_review(logs.root) as running:
        running.open_page()
        yield running


@pytest.fixture
def review_of(tmp_path: Path) -> Iterator[StartReview]:
    """Start a review of another folder."""
    with contextlib.ExitStack() as stack:

        def start(root: Path, password: Password | None = None) -> Review:
            return stack.enter_context(running_review(root, password))

        yield start
