"""No worker outlives its purpose, not even one in which Python cannot run any more."""

import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from tests.web.conftest import StartServer, wait_until
from tests.web.test_faults import gone
from tests.web.test_run import browsing

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]
PRELOAD = ("viser", "tests.faults.short_patience")

SCRIPT = f"""
import sys
from pathlib import Path
from app.web.config import ServerConfig
from app.web.run import serve
serve(ServerConfig(port=0, sessions=Path(sys.argv[1]), preload={PRELOAD!r},
                   worker_entry="tests.faults.entries:hang_at_once", status_timeout_s=1e6))
"""


def test_the_kernel_ends_a_worker_that_holds_the_interpreter(start_server: StartServer) -> None:
    """A C call that never returns: the timer is not wound again, and the page is told."""
    server = start_server(
        worker_entry="tests.faults.entries:hang_at_once", preload=PRELOAD, status_timeout_s=1e6
    )
    browser = server.browser()
    page = browser.page()
    pid = server.pid_of(browser.session)
    assert "stopped answering" in page.next("ended")["reason"]
    assert gone(pid)
    assert server.health()["sessions"] == 0


def test_a_hung_worker_does_not_survive_a_killed_server(tmp_path: Path) -> None:
    """Nobody is left to kill it but the kernel."""
    with (tmp_path / "log").open("w") as log:
        process = subprocess.Popen(
            [sys.executable, "-c", SCRIPT, str(tmp_path / "sessions")],
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        )
    assert process.stdout
    try:
        url = process.stdout.readline().split()[3]
        with browsing(url) as browser:
            browser.page()
            started = psutil.Process(process.pid).children(recursive=True)
            assert len(started) >= 2  # the forkserver and the worker
            process.send_signal(signal.SIGKILL)
            process.wait()
            wait_until(lambda: all(gone(child.pid) for child in started))
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
