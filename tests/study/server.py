"""`hindsight study` as a subprocess on a port of its own: it can be killed and come back."""

import os
import re
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

HINDSIGHT = Path(sys.executable).with_name("hindsight")
WAIT_S = 120.0


def free_port() -> int:
    """A port nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@dataclass
class StudyServer:
    """A study's server, its folder and its log."""

    folder: Path
    options: tuple[str, ...] = ("--test-run",)
    study: str = "paper"
    port: int = field(default_factory=free_port)
    process: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        """Where it is, also after a restart."""
        return f"http://127.0.0.1:{self.port}"

    @property
    def sessions(self) -> Path:
        """The folder of sessions."""
        return self.folder / "sessions"

    def log(self) -> str:
        """What it has said."""
        return (self.folder / "server.log").read_text(encoding="utf-8")

    def start(self) -> "StudyServer":
        """Start it and wait until it listens."""
        command = [str(HINDSIGHT), "study", self.study, "--port", str(self.port)]
        with (self.folder / "server.log").open("wb") as log:
            self.process = subprocess.Popen(
                [*command, "--sessions", str(self.sessions), *self.options],
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
            )
        deadline = time.monotonic() + WAIT_S
        while not re.search(r"is at http", self.log()):
            assert self.process.poll() is None, self.log()
            assert time.monotonic() < deadline, self.log()
            time.sleep(0.05)
        return self

    def kill(self) -> None:
        """SIGKILL: nothing is tidied up."""
        assert self.process is not None
        self.process.kill()
        self.process.wait()

    def stop(self) -> None:
        """SIGTERM, and wait."""
        if self.process is not None and self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(30)
            except subprocess.TimeoutExpired:
                self.kill()
                raise
