"""What breaks is said in clear words, touches no other session, and leaves nothing behind."""

import os
import signal
import time
from pathlib import Path

import psutil
import pytest
from websockets.exceptions import ConnectionClosed

from tests.web.conftest import Page, Server, StartServer, wait_until
from tests.web.test_view_messages import pack


def close_code(page: Page) -> int | None:
    """Code with which the server closes the page's socket."""
    with pytest.raises(ConnectionClosed) as caught:
        while True:
            page.socket.recv(30)
    return caught.value.rcvd.code if caught.value.rcvd else None


def gone(pid: int) -> bool:
    """Whether no such process runs (a zombie does not)."""
    try:
        return psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def test_a_killed_worker_ends_one_session_only(server: Server):
    """Its page is told and may start anew; the other session's worker notices nothing."""
    browser, other = server.browser(), server.browser()
    page, bystander = browser.page(), other.page()
    viewer = browser.viewer()
    other_pid = server.pid_of(other.session)
    pid = server.pid_of(browser.session)
    os.kill(pid, signal.SIGKILL)
    reason = page.next("ended")["reason"]
    assert "stopped unexpectedly" in reason and "SIGKILL" in reason and "memory" in reason
    assert close_code(page) == 4001
    with pytest.raises(ConnectionClosed):
        while True:
            viewer.recv(30)
    assert bystander.command(1, "grasp")["error"] is None
    assert server.pid_of(other.session) == other_pid
    assert gone(pid)
    again = browser.page()
    assert (page.hello["run"], again.hello["run"]) == (1, 2)
    assert again.next("status")["session"] == "2"
    assert server.pid_of(browser.session) != pid


def test_a_worker_that_fails_by_itself_is_named(server: Server):
    """The exit code is in the words, for who reads them over the telephone."""
    page = server.browser().page()
    page.send(type="command", id=1, name="method", method="crash")
    assert "exit code 7" in page.next("ended")["reason"]


def test_a_hung_worker_is_killed(start_server: StartServer):
    """Stopped as by a debugger, it can neither answer nor end: it goes, and the page knows."""
    server = start_server(status_timeout_s=1.0)
    browser = server.browser()
    page = browser.page()
    page.next("status")
    pid = server.pid_of(browser.session)
    os.kill(pid, signal.SIGSTOP)
    assert "stopped answering" in page.next("ended")["reason"]
    wait_until(lambda: gone(pid))
    assert server.health()["sessions"] == 0


def test_a_worker_that_cannot_start_is_said_and_not_started_in_a_circle(
    start_server: StartServer,
):
    """The page is told why; a page that tries again and again is told to wait."""
    server = start_server(options={"fault": "no-start"})
    browser = server.browser()
    reasons = []
    for _ in range(6):
        page = browser.dial()
        reasons.append(page.next("ended")["reason"])
        assert close_code(page) in (4001, 4003)
    assert "could not be started: exit code 3" in reasons[0]
    assert "wait a minute" in reasons[-1]


def test_a_deaf_worker_is_killed_at_the_end(start_server: StartServer):
    """One that does not obey `end` is given its time, then killed: the server always stops."""
    server = start_server(options={"fault": "deaf"}, end_grace_s=0.5, linger_s=0.1)
    browser = server.browser()
    page = browser.page()
    pid = server.pid_of(browser.session)
    page.socket.close()
    wait_until(lambda: server.health()["sessions"] == 0)
    assert gone(pid)


def test_fifty_reconnects_leave_nothing_behind(server: Server):
    """Neither file handles nor tasks nor viewers pile up in the web process or the worker."""
    browser = server.browser()
    browser.page()
    pid = server.pid_of(browser.session)

    def reconnect(times: int) -> None:
        for _ in range(times):
            page = browser.dial()
            page.next("hello")
            with browser.viewer() as viewer:
                viewer.send(pack())
                viewer.recv(30)
            page.socket.close()

    def handles() -> tuple[int, int]:
        return len(os.listdir("/proc/self/fd")), len(os.listdir(f"/proc/{pid}/fd"))

    def settled() -> bool:
        session = server.registry.by_id(browser.session)
        assert session
        return session.sockets == 0 and len(session.clients) == 1

    reconnect(2)
    wait_until(settled)
    before = handles()
    reconnect(50)
    wait_until(settled)
    wait_until(lambda: handles() <= before)
    assert server.pid_of(browser.session) == pid


def test_a_flood_of_input_harms_only_its_own_socket(server: Server):
    """Sent as fast as the socket takes it: the sender is disconnected, others go on."""
    flooder, other = server.browser(), server.browser()
    page, bystander = flooder.page(), other.page()
    with pytest.raises(ConnectionClosed) as caught:
        for number in range(100_000):
            page.push(number)
        while True:
            page.socket.recv(30)
    assert caught.value.rcvd is None or caught.value.rcvd.code == 1008
    started = time.monotonic()
    assert bystander.command(1, "grasp")["error"] is None
    bystander.push(1, right=[1, 0])
    bystander.status_where(lambda s: s["input"])
    assert time.monotonic() - started < 30
    assert flooder.page().next("status")  # and the flooder may come back


def test_all_workers_end_with_the_server(start_server: StartServer, tmp_path: Path):
    """No worker outlives its web process, also with pages open."""
    server = start_server()
    pids = []
    for _ in range(3):
        browser = server.browser()
        browser.page()
        pids.append(server.pid_of(browser.session))
    server.stop()
    assert all(gone(pid) for pid in pids)
