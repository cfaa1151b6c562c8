"""`serve` as a process: what it prints, what it refuses, and how it ends."""

import contextlib
import importlib
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import psutil
import pytest

from app.cli import build_parser
from app.recording.store import session_folder
from app.session.spec import WorkerSpec
from app.simulate.attract import main as attract_main
from app.web.config import ConfigError, ServerConfig
from app.web.housekeeping import complete_session, forget_old
from app.web.run import ServeError, bind, serve
from tests.web.conftest import Browser, Server, wait_until

SCRIPT = """
import sys
from pathlib import Path
from app.web.config import ServerConfig
from app.web.run import serve
serve(ServerConfig(port=0, sessions=Path(sys.argv[1]), worker_entry="tests.web.standin:main",
                   preload=("viser",), end_grace_s=5.0))
"""


@contextlib.contextmanager
def serving(folder: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A server process and its address."""
    with (folder / "log").open("w") as log:
        command = [sys.executable, "-c", SCRIPT, str(folder / "sessions")]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
    assert process.stdout
    try:
        line = process.stdout.readline()
        found = re.search(r"http://127\.0\.0\.1:\d+", line)
        assert found, line + (folder / "log").read_text()
        yield process, found.group()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


@contextlib.contextmanager
def browsing(url: str) -> Iterator[Browser]:
    """A browser on that address."""
    with httpx.Client(base_url=url, trust_env=False) as http, contextlib.ExitStack() as stack:
        server = Server(url, None, stack, lambda: None)  # type: ignore[arg-type]
        browser = Browser(server, http)
        with browser.stack:
            yield browser


def tree(process: subprocess.Popen[str]) -> list[psutil.Process]:
    """The server's children and theirs."""
    return psutil.Process(process.pid).children(recursive=True)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_server_and_everything_it_started(tmp_path: Path, number: int):
    """Exit code 0, and no process is left."""
    with serving(tmp_path) as (process, url), browsing(url) as browser:
        page = browser.page()
        page.next("status")
        started = tree(process)
        assert len(started) >= 2  # the forkserver and a worker
        process.send_signal(number)
        assert page.next("ended")["reason"]
        assert process.wait(30) == 0, (tmp_path / "log").read_text()
        wait_until(lambda: not [p for p in started if p.is_running()])


def test_no_worker_survives_a_killed_server(tmp_path: Path):
    """SIGKILL leaves the server no time; the workers see the end of their socket."""
    with serving(tmp_path) as (process, url), browsing(url) as browser:
        browser.page().next("status")
        started = tree(process)
        process.kill()
        process.wait()
        wait_until(lambda: not [p for p in started if p.is_running()])


def test_the_log_names_no_address_of_a_participant(tmp_path: Path):
    """The access log is off: an ordinary visit writes nothing at all."""
    with serving(tmp_path) as (_, url), browsing(url) as browser:
        page = browser.page()
        page.next("status")
        page.socket.close()
        assert (tmp_path / "log").read_text() == ""


def test_a_port_in_use_is_named_with_what_to_do(tmp_path: Path):
    """The port, and the option that chooses another."""
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(ServeError, match=f"port {port} is in use.*--port"):
            serve(ServerConfig(port=port, sessions=tmp_path))


def test_an_unknown_host_is_named():
    """A name without an address."""
    config = ServerConfig(host="no-such-host.invalid", public_origin="https://lab.example.org")
    with pytest.raises(ServeError, match="no-such-host.invalid"):
        bind(config)


def test_a_sessions_folder_that_cannot_be_is_named(tmp_path: Path):
    """A file is in the way."""
    (tmp_path / "file").write_text("")
    with pytest.raises(ServeError, match=f"{tmp_path}/file/sessions"):
        serve(ServerConfig(port=0, sessions=tmp_path / "file" / "sessions"))


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "lab.example.org"])
def test_listening_beyond_this_machine_needs_a_tls_proxy(host: str):
    """Refused by default; the words name the host and the option."""
    with pytest.raises(ConfigError, match=f"'{host}'.*--behind-tls-proxy"):
        ServerConfig(host=host)
    assert ServerConfig(host=host, public_origin="https://lab.example.org").behind_tls_proxy


@pytest.mark.parametrize(
    "origin",
    ["http://lab.example.org", "lab.example.org", "https://a/b", "https://", "https://u@h"],
)
def test_a_public_origin_is_https_and_bare(origin: str):
    """Anything else is named together with an example."""
    with pytest.raises(ConfigError, match="https://lab.example.org"):
        ServerConfig(public_origin=origin)


@pytest.mark.parametrize(
    "change", [{"port": 70000}, {"capacity": -1}, {"linger_s": -1.0}, {"status_timeout_s": 0.0}]
)
def test_a_number_out_of_range_is_named(change: dict):
    """The setting, its value, and what is valid."""
    ((name, value),) = change.items()
    with pytest.raises(ConfigError, match=f"{name} is {value}; valid"):
        ServerConfig(**change)


def test_old_demo_sessions_are_deleted_and_no_others(tmp_path: Path):
    """By the age of the newest file; other studies are never touched."""
    old = session_folder(tmp_path, "demo", "old", "1")
    new = session_folder(tmp_path, "demo", "new", "1")
    study = session_folder(tmp_path, "ours", "old", "1")
    for folder in (old, new, study):
        folder.mkdir(parents=True)
        (folder / "trial-001.mcap").write_bytes(b"x")
    for folder in (old, study):
        for path in (folder / "trial-001.mcap", folder, folder.parent):
            os.utime(path, (0, 0))
    assert forget_old(tmp_path, "demo", 30) == 1
    assert not old.exists() and new.exists() and study.exists()


def test_a_session_without_torn_logs_needs_nothing(tmp_path: Path):
    """A worker may die before its first trial."""
    spec = WorkerSpec(id="abc", scene="default", settings={}, sessions=str(tmp_path))
    assert complete_session(spec) == 0


def test_attract_lets_simulated_users_drive():
    """The option chooses what the workers run; without it nobody simulated is there."""
    parse = build_parser().parse_args
    plain = ServerConfig.from_arguments(parse(["run"]))
    attract = ServerConfig.from_arguments(parse(["run", "--attract"]))
    assert plain.worker_entry == "app.session.worker:main"
    module, _, name = attract.worker_entry.partition(":")
    assert getattr(importlib.import_module(module), name) is attract_main
    assert module in attract.preload and set(plain.preload) < set(attract.preload)
