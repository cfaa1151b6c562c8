"""A worker that breaks in mid-trial: the page is told in words, the next session goes on."""

import os
import re
import resource
import signal
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from app.recording.reader import read_steps, read_trial
from app.session.verify import resimulate
from tests.faults.conftest import goes_on, recovered, running
from tests.faults.entries import CLOCK_STEP_S
from tests.web.conftest import Browser, Page, Server, StartServer, wait_until
from tests.web.test_faults import gone

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]
Fault = Callable[..., None]


def two(server: Server) -> tuple[Browser, Page, Page]:
    """A browser with its page, both with a running trial, and a bystander's page."""
    browser, other = server.browser(), server.browser()
    page, bystander = browser.page(), other.page()
    running(page)
    running(bystander)
    return browser, page, bystander


def notice(page: Page, words: str) -> str:
    """The next notice with these words."""
    while words not in (text := page.next("notice")["text"]):
        pass
    return text


def log_of(server_sessions: Path, session: str) -> Path:
    """The finished log of a session's first trial."""
    raw = server_sessions / "demo" / "data" / "raw"
    return raw / f"subject-{session}" / "session-1" / "trial-001.mcap"


@pytest.mark.parametrize("how", ["read-only", "full"])
def test_a_disk_that_refuses_in_mid_trial(
    breaking: Server, fault: Fault, tmp_path: Path, how: str
) -> None:
    """The page is told, the arm moves on, and with the disk back not a tick is missing."""
    browser, page, bystander = two(breaking)
    process = psutil.Process(breaking.pid_of(browser.session))
    free = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
    if how == "full":
        process.rlimit(psutil.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))
    else:
        fault("disk", browser.session)
    text = notice(page, "trial")
    assert re.search("Read-only file system|File too large|No space", text), text
    goes_on(page)
    goes_on(bystander)
    if how == "full":
        process.rlimit(psutil.RLIMIT_FSIZE, free)
    else:
        fault("disk", browser.session, on=False)
    notice(page, "written again")
    assert page.command(1, "new-trial")["error"] is None
    path = log_of(tmp_path / "sessions", browser.session)
    wait_until(path.exists)
    steps = read_steps(path)
    assert [step.step for step in steps] == list(range(len(steps)))
    assert read_trial(path).summary is not None
    assert resimulate(read_trial(path).header, steps) is None


def test_a_wall_clock_that_is_stepped(breaking: Server, fault: Fault, tmp_path: Path) -> None:
    """An hour forward and back again: no tick is skipped for it, and the log repeats."""
    browser, page, bystander = two(breaking)
    fault("clock", browser.session)
    time.sleep(0.4)
    goes_on(page)
    fault("clock", browser.session, on=False)
    time.sleep(0.4)
    goes_on(page)
    goes_on(bystander)
    assert page.command(1, "new-trial")["error"] is None
    path = log_of(tmp_path / "sessions", browser.session)
    wait_until(path.exists)
    log, steps = read_trial(path), read_steps(path)
    wall = [step.wall_s for step in steps]
    assert max(wall) - min(wall) > CLOCK_STEP_S - 60
    assert all(b.monotonic_s > a.monotonic_s for a, b in zip(steps, steps[1:], strict=False))
    assert steps[-1].monotonic_s - steps[0].monotonic_s < CLOCK_STEP_S / 2
    assert log.summary is not None and log.summary.duration_s < CLOCK_STEP_S / 2
    assert [step.step for step in steps] == list(range(len(steps)))
    assert resimulate(log.header, steps) is None


def test_a_hung_worker_loses_a_quarter_of_a_second(
    start_server: StartServer, tmp_path: Path
) -> None:
    """Stopped in mid-trial, then ended by the server; what was shown before is in the log."""
    server = start_server(
        worker_entry="app.session.worker:main",
        preload=("app.session.preload",),
        options={"timeout_s": 0},
        status_timeout_s=3.0,
    )
    browser, page, bystander = two(server)
    pid = server.pid_of(browser.session)
    shown = page.next("status")["trial"]["seconds"]
    time.sleep(0.5)  # twice what may be lost
    os.kill(pid, signal.SIGSTOP)
    assert "stopped answering" in page.next("ended")["reason"]
    goes_on(bystander)
    steps = recovered(tmp_path / "sessions", browser.session)
    assert steps[-1].time_s >= shown
    assert gone(pid)
    again = browser.page()
    assert running(again) and again.hello["session"] == browser.session


def test_a_worker_without_memory(breaking: Server, fault: Fault, tmp_path: Path) -> None:
    """Its allocation fails in the middle of a tick: the session ends in words, with its log."""
    browser, page, bystander = two(breaking)
    pid = breaking.pid_of(browser.session)
    shown = page.next("status")["trial"]["seconds"]
    fault("memory", browser.session)
    reason = page.next("ended")["reason"]
    assert "no memory" in reason
    goes_on(bystander)
    wait_until(lambda: gone(pid))
    steps = recovered(tmp_path / "sessions", browser.session)
    assert steps[-1].time_s >= shown - 0.25
    fault("memory", browser.session, on=False)
    assert running(browser.page())


def test_a_viewer_whose_port_is_gone(breaking: Server, fault: Fault) -> None:
    """The page is told that the picture is gone; steering and other sessions go on."""
    browser, page, bystander = two(breaking)
    viewer = browser.viewer()
    fault("viewer", browser.session)
    with pytest.raises(ConnectionClosed) as caught:
        while True:
            viewer.recv(60)
    assert caught.value.rcvd is None or caught.value.rcvd.code == 1011
    assert "the robot still obeys" in notice(page, "picture")
    with pytest.raises(InvalidStatus) as refused:
        browser.viewer()
    assert refused.value.response.status_code == 502
    assert page.command(1, "method", method="direct")["error"] is None
    goes_on(page)
    goes_on(bystander)


def test_a_page_that_sleeps_and_wakes(breaking: Server) -> None:
    """No message for long: no input counts, the trial goes on, and the next push is obeyed."""
    browser, page, bystander = two(breaking)
    assert page.command(1, "method", method="direct")["error"] is None
    page.push(1, right=[0.0, 0.9], t=time.monotonic() * 1e3)
    page.status_where(lambda s: s["direct"][0] > 0.05)
    page.status_where(lambda s: not any(s["direct"]))
    time.sleep(3.0)
    goes_on(page)
    number = 1

    def push() -> bool:
        nonlocal number
        number += 1
        page.push(number, right=[0.0, 0.9], t=time.monotonic() * 1e3)
        return page.next("status")["direct"][0] > 0.05

    wait_until(push)
    goes_on(bystander)


def test_fifty_reconnects_resume_one_trial(breaking: Server) -> None:
    """The same trial goes on, and neither process keeps anything of the lines that broke."""
    browser = breaking.browser()
    page = browser.page()
    running(page)
    number = page.next("status")["trial"]["number"]
    pid = breaking.pid_of(browser.session)

    def reconnect(times: int) -> None:
        nonlocal page
        for _ in range(times):
            page.socket.close()
            page = browser.page()
            with browser.viewer() as viewer:
                viewer.recv(60)

    def handles() -> tuple[int, int]:
        return len(os.listdir("/proc/self/fd")), psutil.Process(pid).num_fds()

    def settled() -> bool:
        session = breaking.registry.by_id(browser.session)
        return session is not None and session.sockets == 0 and len(session.clients) == 1

    reconnect(2)
    wait_until(settled)
    before = handles()
    reconnect(50)
    wait_until(settled)
    wait_until(lambda: all(b <= a for a, b in zip(before, handles(), strict=True)))
    assert breaking.pid_of(browser.session) == pid
    assert page.next("status")["trial"]["number"] == number
    goes_on(page)
