"""A worker end to end: a real process, a real socket pair, a real log."""

import contextlib
import math
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from app.recording.listing import list_trials
from app.recording.reader import read_steps, read_trial
from app.recording.recovery import recover_folder
from app.session.verify import resimulate
from tests.session.live import Live, Message

pytestmark = pytest.mark.timeout(400)
Start = Callable[..., Live]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts workers and ends what is left of them."""
    running: list[Live] = []

    def begin(**options: Any) -> Live:
        running.append(Live(tmp_path, **options))
        return running[-1]

    yield begin
    for live in running:
        live.close()


def grasp_by_eye(live: Live, target: str) -> Message:
    """Steer by the hand and object values of the status alone, as the page's user does."""
    aligned, settled, seen = False, 0, None
    while True:
        status = live.status_where(lambda s, last=seen: s is not last)
        seen = status
        if status["trial"]["outcome"] != "running":
            return status
        dx, dy, dz = (o - h for o, h in zip(status["objects"][target], status["hand"], strict=True))
        aligned = aligned or (abs(dy) < 0.012 and abs(dz) < 0.02)
        aligned = aligned and not (abs(dy) > 0.03 and dx > 0.05)
        if aligned and math.hypot(dx, dy) < 0.012 and abs(dz) < 0.03:
            settled += 1
            live.push((0.0, 0.0), (0.0, 0.0))
            if settled == 6:
                assert live.command(50, "grasp")["error"] is None
            continue
        settled = 0
        forward = dx if aligned else min(0.0, dx - 0.16)
        away, left, up = (max(-1.0, min(1.0, 8.0 * e)) for e in (forward, dy, dz))
        live.push((0.0, up), (-left, away))


def test_a_session_from_ready_to_its_log(start: Start, tmp_path: Path):
    """Ready, a grasp by eye, the outcome, a log that reads and repeats; then the next trial."""
    live = start(seed=2, target="glass")
    ready = live.wait("ready")
    assert ready["pid"] == live.process.pid and ready["viewer_port"] > 0
    hello = ready["hello"]
    assert [item["name"] for item in hello["scene"]["objects"]] == ["canteen", "block", "glass"]
    assert hello["trial"]["target"] == "glass" and hello["recorded"] is True
    status = grasp_by_eye(live, "glass")
    assert (status["trial"]["outcome"], status["trial"]["grasped"]) == ("grasped", "glass")
    assert max(status["belief"], key=status["belief"].get) == "glass"
    assert status["reason"]["glass"]

    assert live.command(60, "open")["error"] is None
    path = live.folder / "trial-001.mcap"
    live.until(path.exists)
    log = read_trial(path)
    assert log.summary is not None and log.summary.outcome == "grasped"
    assert log.header.participant == "live" and log.header.seed == 2
    names = [event.name for event in log.events]
    assert names[0] == "settings" and {"start", "grasp", "outcome"} <= set(names)
    steps = read_steps(path)
    assert [step.step for step in steps] == list(range(len(steps)))
    assert sum(step.device == "pointer" and step.input_norm > 0 for step in steps) > 50
    assert resimulate(log.header, steps) is None

    error = live.command(61, "new-trial", target="teapot")["error"]
    assert "teapot" in error and "canteen, block, glass" in error
    assert live.command(62, "new-trial", method="magic")["error"].startswith("method is 'magic'")
    assert "clutter" in live.command(63, "new-trial", scene="/etc/passwd")["error"]
    assert live.status is not None and live.status["trial"]["number"] == 1
    assert live.command(64, "new-trial", target="block", seed=9, method="blend")["error"] is None
    trial = live.status_where(lambda s: s["trial"]["number"] == 2)["trial"]
    assert (trial["target"], trial["seed"], trial["method"]) == ("block", 9, "blend")
    assert trial["outcome"] == "running"

    live.send({"type": "end"})
    assert live.wait("ended")["reason"] == "The session has ended."
    assert live.finish() == 0
    assert live.messages[-1]["type"] == "ended"
    outcomes = [(entry.trial, entry.outcome) for entry in list_trials(tmp_path)]
    assert sorted(outcomes) == [(1, "grasped"), (2, "aborted")]


def test_another_scene_and_the_view(start: Start):
    """A new scene says hello again; layers, camera and theme answer and show in the status."""
    live = start(record=False, start="input")
    live.wait("ready")
    assert live.command(1, "new-trial", scene="clutter")["error"] is None
    hello = live.wait("hello")
    assert len(hello["scene"]["objects"]) == 5 == len(hello["trial"]["scene"]) - 2
    status = live.status_where(lambda s: s["trial"]["scene"] == "clutter")
    assert len(status["belief"]) == 5 and status["trial"]["phase"] == "ready"
    assert live.command(2, "layers", changes={"path": True, "slice": False})["error"] is None
    live.status_where(lambda s: s["layers"]["path"] and not s["layers"]["slice"])
    assert "does not exist" in live.command(3, "layers", changes={"fog": True})["error"]
    assert live.command(4, "camera", preset="top")["error"] is None
    live.status_where(lambda s: s["camera"] == "top")
    assert "bogus" in live.command(5, "camera", preset="bogus")["error"]
    assert live.command(6, "theme", theme="light")["error"] is None
    assert live.command(7, "settings", changes={"gain": 0.5})["error"] is None
    live.status_where(lambda s: s["settings"]["gain"] == 0.5)
    assert "gain" in live.command(8, "settings", changes={"gain": 9})["error"]
    live.send({"type": "end"})
    assert live.finish() == 0
    assert not live.folder.exists()


def test_lost_input_and_page_events_are_recorded(start: Start):
    """A blurred page stops steering at once, and the log says when and why."""
    live = start(seed=1, hold_on_loss=True)
    live.wait("ready")
    live.status_where(lambda s: s["trial"]["phase"] == "running")

    def push() -> bool:
        live.push((0.0, 0.0), (0.0, 0.9))
        return live.status is not None and live.status["direct"][0] > 0.1

    live.until(push)
    live.send({"type": "event", "client": "c1", "name": "blur"})
    live.until(lambda: not push() and live.status is not None and not any(live.status["executed"]))
    live.send({"type": "event", "client": "c1", "name": "focus"})
    live.until(push)
    live.send({"type": "clients", "control": None, "count": 0})
    live.status_where(lambda s: not any(s["direct"]))
    live.send({"type": "clients", "control": "c1", "count": 1})
    live.until(push)
    live.sock.shutdown(1)  # the web process is gone: the worker ends by itself
    assert live.finish() == 0
    log = read_trial(live.folder / "trial-001.mcap")
    names = [event.name for event in log.events]
    for name in ("blur", "focus", "disconnect", "reconnect", "input_lost", "input_back"):
        assert name in names
    assert names.count("disconnect") == names.count("reconnect") == 1
    assert any('"blur"' in event.detail for event in log.events if event.name == "input_lost")
    assert log.summary is not None and log.summary.outcome == "aborted"


def test_sigterm_closes_the_log(start: Start):
    """An orderly stop: the log is whole and the exit code 0."""
    live = start(seed=1)
    live.status_where(lambda s: s["trial"]["seconds"] > 0.3)
    os.kill(live.process.pid or 0, signal.SIGTERM)
    assert live.wait("ended")["reason"] == "The server was stopped."
    assert live.finish() == 0
    log = read_trial(live.folder / "trial-001.mcap")
    assert log.summary is not None and log.n_steps == log.summary.steps


def test_sigkill_loses_at_most_a_quarter_second(start: Start):
    """What was shown 0.25 s before the death is in the recovered log, and repeats."""
    live = start(seed=1)
    seconds = live.status_where(lambda s: s["trial"]["seconds"] > 1.0)["trial"]["seconds"]
    time.sleep(0.5)
    assert live.status is not None
    shown = live.status["trial"]["seconds"]
    os.kill(live.process.pid or 0, signal.SIGKILL)
    assert live.finish() == -signal.SIGKILL
    assert shown > seconds
    (report,) = recover_folder(live.folder)
    assert report.action == "completed"
    log = read_trial(live.folder / "trial-001.mcap")
    assert log.summary is not None
    assert (log.summary.outcome, log.summary.recovered) == ("interrupted", True)
    steps = read_steps(log.path)
    assert steps[-1].time_s >= shown - 0.25
    assert resimulate(log.header, steps) is None


def test_a_study_hides_and_refuses(start: Start):
    """What must not reach the browser does not leave the process; the server may do all."""
    live = start(
        hide=["belief", "assistance", "method", "settings"],
        commands=["grasp", "open"],
        start="signal",
        record=False,
    )
    ready = live.wait("ready")
    assert "policy" not in str(ready)
    refused = live.command(1, "method", method="direct")["error"]
    assert refused == "method is not possible here; valid: grasp, open"
    status = live.status_where(lambda s: s["trial"]["phase"] == "ready")
    for field in ("belief", "reason", "assistance", "assist_stick", "settings", "value_range"):
        assert field not in status
    assert "method" not in status["trial"]
    assert not status["layers"]["slice"] and not status["layers"]["ghosts"]
    live.send({"type": "command", "client": "server", "id": 2, "name": "start"})
    assert live.wait("ack", lambda m: m["id"] == 2)["error"] is None
    live.status_where(lambda s: s["trial"]["phase"] == "running")


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"scene": "kitchen"}, "kitchen"),
        ({"viewer_hz": -1}, "viewer_hz is -1"),
        ({"target": "teapot", "record": False}, "teapot"),
        ({"name": "../up"}, "../up"),
    ],
)
def test_a_bad_spec_is_told(start: Start, options: dict[str, Any], text: str):
    """The worker says what is wrong and ends; it never becomes ready."""
    live = start(**options)
    assert text in live.wait("ended")["reason"]
    with contextlib.suppress(AssertionError):
        live.finish()
    assert [message["type"] for message in live.messages] == ["ended"]
