"""`hindsight run` as a subprocess on a free port, as a person starts it."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

HINDSIGHT = Path(sys.executable).with_name("hindsight")


@dataclass
class Server:
    """A running server: its process, address and folder of sessions."""

    process: subprocess.Popen[str]
    url: str
    sessions: Path
    output: Path

    def health(self) -> dict:
        """What GET /api/health says."""
        with urllib.request.urlopen(self.url + "/api/health", timeout=5) as response:
            return json.load(response)


@contextlib.contextmanager
def running_server(folder: Path, *options: str) -> Iterator[Server]:
    """Start the server, wait for its address, and stop it by SIGTERM at the end."""
    sessions, output = folder / "sessions", folder / "server.log"
    with output.open("w") as log:
        process = subprocess.Popen(
            [str(HINDSIGHT), "run", "--port", "0", "--sessions", str(sessions), *options],
            stdout=log,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
            start_new_session=True,
        )
    try:
        yield Server(process, _address(process, output), sessions, output)
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            raise


def _address(process: subprocess.Popen[str], output: Path) -> str:
    deadline = time.monotonic() + 90
    while time.monotonic() < deadline:
        found = re.search(r"http://127\.0\.0\.1:\d+", output.read_text())
        if found:
            return found.group()
        assert process.poll() is None, f"the server ended:\n{output.read_text()}"
        time.sleep(0.05)
    raise AssertionError(f"the server named no address:\n{output.read_text()}")
