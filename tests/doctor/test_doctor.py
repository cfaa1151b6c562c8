"""The doctor names what would spoil a session, how bad it is, and what to do."""

import json
import os
import re
import socket
from pathlib import Path
from types import SimpleNamespace

import pytest

from app.cli import main
from app.doctor import command, storage
from app.doctor.finding import Finding, format_findings, worst
from app.doctor.graphics import judge_renderer
from app.doctor.machine import check_capacity, check_clock, check_handles, check_timer
from app.doctor.network import check_loopback, check_ports
from app.doctor.packages import check_packages, installed_version, read_lock
from app.doctor.storage import check_logs, check_storage, judge_speed
from app.recording.store import open_session
from app.recording.writer import TrialWriter
from app.web.capacity import Capacity
from tests.recording.samples import make_header


def test_the_report_has_a_line_for_everything(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every finding is printed with its level; advice stands below; the exit code is the worst."""
    code = main(["doctor", "--sessions", str(tmp_path), "--port", "0", "--no-browser", "--json"])
    findings = [Finding(**line) for line in json.loads(capsys.readouterr().out)]
    names = {finding.name for finding in findings}
    assert names >= {
        "Python", "Packages", "Kernels", "Page", "Port", "Loopback", "Disk space", "Write speed",
        "Logs", "Clock", "Timer", "Capacity", "File handles",
    }  # fmt: skip
    assert code == int(worst(findings) == "bad")
    for finding in findings:
        assert finding.text
        assert finding.level == "ok" or finding.advice, finding
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("level", "code"), [("ok", 0), ("warn", 0), ("bad", 1)])
def test_only_what_is_bad_fails(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, level: str, code: int
) -> None:
    """A warning leaves the exit code 0, so that scripts go on."""
    findings = [Finding("Disk", "ok", "much"), Finding("Port", level, "some", "do this")]  # type: ignore[arg-type]
    monkeypatch.setattr(command, "examine", lambda *_, **__: iter(findings))
    said: list[str] = []
    assert command.doctor(tmp_path, 0, say=said.append) == code
    assert said[:2] == ["OK    Disk: much", f"{level.upper():<4}  Port: some"]
    assert said[2] == "      → do this"
    assert said[-1] == command.CLOSING[level]  # type: ignore[index]


def test_advice_stands_below_its_line() -> None:
    """And nothing where nothing is to be done."""
    lines = list(format_findings([Finding("A", "ok", "x"), Finding("B", "bad", "y", "z")]))
    assert lines == ["OK    A: x", "BAD   B: y", "      → z"]


def test_packages_are_compared_with_the_lock(tmp_path: Path) -> None:
    """Another version is named with the locked one; a missing package is worse."""
    lock = tmp_path / "requirements.lock"
    lock.write_text(
        "numpy==2.4.6 ; python_version < '3' \\\n    --hash=sha256:00\n"
        "Viser==1.1.9 \\\n    --hash=sha256:00\nmcap==9.9 --hash=sha256:00\n# a comment\n"
    )
    assert read_lock(lock) == {"viser": "1.1.9", "mcap": "9.9"}
    found = check_packages(lock, lambda name: "1.1.9" if name == "viser" else "1.0")
    assert (found.level, found.text) == ("warn", "not as locked: mcap 1.0 instead of 9.9")
    found = check_packages(lock, lambda name: None if name == "mujoco" else "1")
    assert (found.level, found.text) == ("bad", "missing: mujoco")
    assert check_packages(tmp_path / "none").level == "warn"
    assert installed_version("pytest") and installed_version("no-such-package") is None


def test_a_port_in_use_is_named_and_a_hindsight_is_known(tmp_path: Path) -> None:
    """The port and the way out; loopback works on the machine of the tests."""
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        finding = next(check_ports(port))
    assert finding.level == "warn"
    assert f"port {port}" in finding.text and "--port 0" in finding.advice
    assert check_loopback() == Finding("Loopback", "ok", "works")


def test_torn_logs_are_counted_and_living_ones_are_not(tmp_path: Path) -> None:
    """A log that a process writes now is no torn one; set-aside files are told."""
    assert check_logs(tmp_path).level == "ok"
    folder = open_session(tmp_path, "demo", "p1", "1")
    writer = TrialWriter(folder, make_header())
    while not list(folder.glob("*.part")):
        os.sched_yield()
    assert check_logs(tmp_path) == Finding("Logs", "ok", "none torn, 1 being written now")
    (folder / "trial-009.mcap.part").write_bytes(b"\x89MCAP0\r\n")
    finding = check_logs(tmp_path)
    assert finding.level == "warn"
    assert "1 torn, 1 being written now" in finding.text and "trial-009" in finding.text
    writer.close()
    writer.join()
    (folder / "trial-009.mcap.part").rename(folder / "trial-009.mcap")
    finding = check_logs(tmp_path)
    assert finding.level == "warn" and "1 of 2 cannot be used" in finding.text
    assert "trial-009.mcap is torn" in finding.text
    (folder / "trial-009.mcap").rename(folder / "trial-009.mcap.damaged")
    finding = check_logs(tmp_path)
    assert finding.level == "warn" and "1 damaged files were set aside" in finding.text


@pytest.mark.parametrize(("hours", "level"), [(0.5, "bad"), (5.0, "warn"), (100.0, "ok")])
def test_little_room_is_told_in_hours(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, hours: float, level: str
) -> None:
    """The folder need not exist; what counts is the disk it will be on."""
    free = int(hours * storage.HOUR_BYTES)
    monkeypatch.setattr(storage.shutil, "disk_usage", lambda _: SimpleNamespace(free=free))
    finding = next(check_storage(tmp_path / "not" / "yet"))
    assert finding.level == level and str(tmp_path) in finding.text
    assert bool(finding.advice) == (level != "ok")


def test_a_disk_that_cannot_be_written_is_bad(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Whatever the reason: the words of the system are passed on."""

    def refuse(*_: object, **__: object) -> None:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(storage.tempfile, "NamedTemporaryFile", refuse)
    findings = list(check_storage(tmp_path))
    assert findings[-1].level == "bad" and "Read-only file system" in findings[-1].text


@pytest.mark.parametrize(("wait", "level"), [(0.004, "ok"), (0.08, "warn"), (0.5, "bad")])
def test_a_slow_disk_is_judged_by_what_a_killed_trial_would_lose(wait: float, level: str) -> None:
    """0.2 s between two forced writes is the plan."""
    finding = judge_speed(wait, 2 * wait, 50e6)
    assert finding.level == level and f"{1e3 * wait:.1f} ms" in finding.text
    assert bool(finding.advice) == (level != "ok")


def test_clocks_that_are_wrong_or_jump_are_told() -> None:
    """1970 is bad; a step while we look is told with its size."""
    assert check_clock(wall=lambda: 86400.0, sleep=lambda _: None).level == "bad"
    times = iter([2e9, 2e9 + 3600.25])
    steady = iter([0.0, 0.25])
    finding = check_clock(lambda: next(times), lambda: next(steady), lambda _: None)
    assert finding.level == "warn" and "3600000 ms" in finding.text


@pytest.mark.parametrize(("late", "level"), [(0.0002, "ok"), (0.002, "warn"), (0.02, "bad")])
def test_a_sleep_that_ends_late_is_told(late: float, level: str) -> None:
    """By the median, so that one bad moment does not count."""
    now = [0.0]

    def sleep(seconds: float) -> None:
        now[0] += seconds + late

    finding = check_timer(lambda: now[0], sleep)
    assert finding.level == level and f"{1e3 * late:.2f} ms" in finding.text


def test_capacity_says_why_and_how_to_measure() -> None:
    """A measured one needs no advice."""
    finding = check_capacity(Capacity(4, "2 a core, 2 cores"), measured=False)
    assert finding.text == "4 sessions at once (2 a core, 2 cores)"
    assert "bench capacity" in finding.advice
    assert check_capacity(Capacity(4, "measured"), measured=True).advice == ""


def test_file_handles_are_counted_by_sessions() -> None:
    """Too few for the capacity is told with the number to ask for."""
    assert check_handles(4, limit=1024).level == "ok"
    assert check_handles(4, limit=-1).level == "ok"  # no limit
    finding = check_handles(100, limit=1024)
    assert finding.level == "warn" and "ulimit -n 4200" in finding.advice


@pytest.mark.parametrize(
    ("renderer", "level"),
    [
        ("ANGLE (NVIDIA GeForce RTX 3060)", "ok"),
        ("ANGLE (Google, Vulkan (SwiftShader Device))", "warn"),
        ("nothing", "warn"),
        (None, "warn"),
    ],
)
def test_a_browser_is_judged_by_what_draws_in_it(renderer: str | None, level: str) -> None:
    """Software is slow but works; the line names the program."""
    finding = judge_renderer("/usr/bin/chromium", renderer)
    assert finding.level == level and "/usr/bin/chromium" in finding.text
    assert bool(finding.advice) == (level != "ok")


@pytest.mark.browser
def test_the_browser_of_the_tests_names_what_draws_in_it() -> None:
    """A real browser answers with a renderer."""
    from app.doctor.graphics import check_browser

    finding = check_browser()
    assert re.search(r"ANGLE|WebGL|Mesa|NVIDIA|Intel|AMD|nothing|WebKit", finding.text), finding
