"""A real web process whose real workers break on demand."""

from collections.abc import Callable
from pathlib import Path

import pytest

from app.recording.reader import read_steps, read_trial
from app.recording.schema import StepRecord
from tests.web.conftest import Page, Server, StartServer, start_server, wait_until

__all__ = ["start_server"]


@pytest.fixture
def breaking(start_server: StartServer) -> Server:
    """A server whose workers run `tests.faults.entries.main`."""
    return start_server(
        worker_entry="tests.faults.entries:main",
        preload=("app.session.preload",),
        options={"timeout_s": 0},
        settings={"method": "policy"},
        status_timeout_s=15.0,
    )


@pytest.fixture
def fault(tmp_path: Path) -> Callable[..., None]:
    """Switch a fault of a session on, or off again."""

    def switch(name: str, session: str, on: bool = True) -> None:
        flag = tmp_path / "sessions" / f"{name}-{session}"
        flag.touch() if on else flag.unlink()

    return switch


def running(page: Page) -> float:
    """Wait until the trial runs; its seconds as the page shows them."""
    status = page.status_where(lambda s: s["trial"]["seconds"] > 0.3)
    return status["trial"]["seconds"]


def goes_on(page: Page) -> None:
    """Fail unless the page's trial still runs."""
    shown = page.next("status")["trial"]
    page.status_where(lambda s: s["trial"]["seconds"] > shown["seconds"] + 0.1)


def recovered(sessions: Path, session: str, run: str = "1") -> list[StepRecord]:
    """Steps of the first trial's log, once the server has completed it."""
    raw = sessions / "demo" / "data" / "raw"
    path = raw / f"subject-{session}" / f"session-{run}" / "trial-001.mcap"
    wait_until(path.exists)
    assert read_trial(path).summary is not None
    return read_steps(path)
