"""A driver steers until a visitor does, and again when the visitor has gone."""

import json
import random
from pathlib import Path
from typing import Any

import pytest

from app.core import UserInput, preset
from app.recording.reader import read_steps, read_trial
from app.robot.scene import Scene
from app.session.autopilot import RESUME_S, Autopilot
from app.session.frame import Frame
from app.session.inbox import Inbox
from app.session.loop import Health
from app.session.pacing import Beat
from app.session.recorder import Recorder
from app.session.session import Session
from app.session.spec import SessionOptions, WorkerSpec
from app.session.trial import Trial
from app.simulate.attract import Attract
from app.simulate.attract import main as attract_main
from tests.session.live import Live

PUSH = UserInput(axes=(0.0, 0.0, 0.0, 1.0), device="pointer")
REST = UserInput()


class Statue:
    """A driver that pushes away from the robot, and closes where it is told to."""

    close = False
    bored = False

    def act(self, trial: Trial) -> tuple[UserInput, bool]:
        """Always the same."""
        close, self.close = self.close, False
        return UserInput(axes=(0.0, 0.0, 0.0, 0.5), device="simulated"), close

    def wants_next(self, trial: Trial) -> bool:
        """As told, once."""
        bored, self.bored = self.bored, False
        return bored


def test_the_first_push_or_command_takes_over_and_a_quiet_minute_gives_back():
    """Rest within the dead zone is not a push; every push begins the minute anew."""
    autopilot = Autopilot(Statue())
    assert autopilot.watch(REST, 0.0) == "" and autopilot.drives
    resting = UserInput(axes=(0.0, 0.05, 0.0, 0.0), dead_zone=0.1)
    assert autopilot.watch(resting, 1.0) == "" and autopilot.drives
    assert autopilot.watch(PUSH, 2.0) == "handed-over" and not autopilot.drives
    assert autopilot.watch(PUSH, 30.0) == ""
    assert autopilot.watch(REST, 30.0 + RESUME_S - 0.01) == "" and not autopilot.drives
    assert autopilot.watch(REST, 30.0 + RESUME_S) == "resumed" and autopilot.drives
    assert autopilot.take() and not autopilot.take()
    assert autopilot.watch(REST, 200.0) == ""
    assert autopilot.watch(REST, 200.0 + RESUME_S) == "resumed"


class Stage:
    """A session without a clock; its visitor is c1."""

    def __init__(self, scene: Scene, folder: Path | None, driver: Any) -> None:
        self.inbox = Inbox(lambda: None)
        self.said: list[dict[str, Any]] = []
        self.frames: list[Frame] = []
        self.recorder = Recorder(folder)
        self.session = Session(
            WorkerSpec("s1", "default", {"preset": "default"}, "unused"),
            SessionOptions(seed=5),
            scene,
            preset("default", method="policy"),
            self.inbox,
            self.recorder,
            self.said.append,
            driver,
        )
        self.session.connect(
            None,  # type: ignore[arg-type]  # nothing is drawn
            [self.frames.append],
            Health,
            lambda: None,
            lambda: None,
        )
        self.inbox.put({"type": "clients", "control": "c1", "count": 1})
        self.now_s = 0.0

    def run(self, ticks: int) -> Frame:
        """Let time pass."""
        for _ in range(ticks):
            self.now_s += 0.01
            self.session.tick(Beat(self.now_s, 0.0, 0))
        return self.frames[-1]

    def command(self, name: str, **fields: Any) -> str | None:
        """What a visitor's command is answered with."""
        number = random.randrange(10**6)
        self.inbox.put({"type": "command", "client": "c1", "id": number, "name": name, **fields})
        self.run(1)
        return next(m["error"] for m in reversed(self.said) if m.get("id") == number)


def test_a_visitor_begins_where_the_driver_was_and_leaves_no_trace(scene: Scene, tmp_path: Path):
    """Its own trials are marked; the visitor's scene and method are gone with the visitor."""
    driver = Statue()
    stage = Stage(scene, tmp_path, driver)
    frame = stage.run(100)
    assert frame.view.simulated and frame.loss == ""
    assert frame.record.device == "simulated" and frame.record.axes[3] == 0.5
    driver.close = True
    assert stage.run(1).record.phase == "closing"
    driver.bored = True
    assert stage.run(1).view.number == 2

    stage.run(80)
    assert stage.command("method", method="direct") is None
    frame = stage.run(1)
    assert (frame.view.number, frame.view.simulated) == (2, False)
    assert frame.record.device == "none" and not any(frame.record.axes)
    assert frame.loss == "silent"
    assert stage.command("new-trial", scene="clutter") is None
    frame = stage.run(1)
    assert (frame.view.number, frame.view.scene, frame.record.method) == (3, "clutter", "direct")

    stage.now_s += RESUME_S
    frame = stage.run(2)
    assert (frame.view.number, frame.view.simulated) == (4, True)
    assert (frame.view.scene, frame.record.method) == ("default", "policy")
    stage.session.close()
    stage.recorder.close()

    logs = [read_trial(tmp_path / f"trial-00{number}.mcap") for number in (1, 2, 3, 4)]
    drivers = [json.loads(log.header.config_json)["options"].get("driver") for log in logs]
    assert drivers == ["simulated", "simulated", None, "simulated"]
    handovers = [[e.detail for e in log.events if e.name == "handover"] for log in logs]
    assert [len(found) for found in handovers] == [0, 1, 0, 0]
    devices = {step.device for step in read_steps(logs[1].path)}
    assert devices == {"simulated", "none"}


def test_without_a_driver_nothing_is_simulated(scene: Scene):
    """A session as of old."""
    frame = Stage(scene, None, None).run(3)
    assert not frame.view.simulated and frame.record.device == "none"


def test_simulated_users_do_one_trial_after_another(scene: Scene):
    """With physics, from the page's first picture on, and without anybody's help."""
    stage = Stage(scene, None, Attract(seed=1))
    outcomes = []
    while len(outcomes) < 2:
        frame = stage.run(1)
        assert frame.view.simulated and stage.now_s < 200.0
        if frame.record.phase == "done" and frame.view.number == len(outcomes) + 1:
            outcomes.append(frame.outcome)
    assert "grasped" in outcomes


@pytest.mark.timeout(400)
def test_a_worker_hands_over_at_the_first_push(tmp_path: Path):
    """The entry of `hindsight run --attract` in a process of its own."""
    live = Live(tmp_path, entry=attract_main, seed=1, record=False)
    try:
        assert live.wait("ready")["hello"]["trial"]["simulated"] is True
        live.status_where(lambda s: any(s["sticks"]["right"]) and s["trial"]["simulated"])

        def pushed() -> bool:
            live.push((0.0, 0.0), (0.0, 0.9))
            return live.status is not None and live.status["sticks"]["right"] == [0.0, 0.9]

        live.until(pushed)
        assert live.status is not None and live.status["trial"]["simulated"] is False
        live.send({"type": "end"})
        assert live.finish() == 0
    finally:
        live.close()
