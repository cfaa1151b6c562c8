"""What the page is told: complete in a demo, redacted in a study, with reasons in words."""

import json
import math
from typing import Any

import msgspec
import numpy as np
import pytest

from app.core import UserInput, compute_command, preset, settings_to_dict
from app.robot.objects import object_height
from app.robot.scene import Scene
from app.session.frame import Frame, TrialView
from app.session.hello import hello_message
from app.session.kinematic_world import KinematicWorld
from app.session.loop import Health
from app.session.reasons import Reasons
from app.session.spec import HIDEABLE
from app.session.status import assist_stick, status_message
from app.session.trial import Trial


def frame_of(trial: Trial, record) -> Frame:
    """A frame as a session offers it."""
    scene = trial.world.scene
    view = TrialView(
        number=3,
        target=trial.goal,
        shown_as="method1",
        scene=scene.name,
        seed=trial.seed,
        goal_names=scene.object_names,
        object_names=scene.object_names,
        object_heights_m=tuple(object_height(item) for item in scene.objects),
        settings=settings_to_dict(trial.settings),
    )
    return Frame(
        record, view, trial.goals, trial.settings, trial.duration_s, trial.outcome, "", Health()
    )


@pytest.fixture
def frame(scene: Scene) -> Frame:
    """A frame in mid-trial under policy."""
    trial = Trial(KinematicWorld(scene), preset("default", method="policy"), "glass")
    records = [trial.step(UserInput(axes=(0.0, -0.3, 0.5, 0.5))) for _ in range(120)]
    return frame_of(trial, records[-1])


def status(frame: Frame, **changes: Any) -> dict[str, Any]:
    """The message of a frame."""
    options: dict[str, Any] = {
        "layers": {"slice": True},
        "camera": "operator",
        "value_range": (0.0, 2.0),
        "reasons": {"glass": "you push toward it"},
    }
    return status_message(frame, **(options | changes))


def test_a_status_holds_every_field_of_the_contract(frame: Frame):
    """And is finite JSON of bounded size."""
    message = status(frame)
    fields = """type trial belief hand hand_quaternion objects direct assistance executed
        assist_stick sticks loss loop settings settings_id layers camera value_range
        leading_target reason"""
    assert set(message) == set(fields.split())
    trial = """number target method shown_as phase outcome seconds input grasped scene
        seed simulated"""
    assert set(message["trial"]) == set(trial.split())
    assert sum(message["belief"].values()) == pytest.approx(1.0)
    text = msgspec.json.encode(message)
    assert len(text) < 4000
    assert json.loads(text) == json.loads(json.dumps(message))
    assert message["objects"]["glass"][2] == pytest.approx(0.055)


def test_every_hidden_part_is_absent(frame: Frame):
    """With everything hidden nothing but what a study's page needs is left, at any depth."""
    hidden = status(frame, hide=HIDEABLE)
    text = json.dumps(hidden)
    for word in ("belief", "policy", "gain", "assist_stick", 'glass": [', "lateness", "reason"):
        assert word not in text
    assert hidden["trial"]["shown_as"] == "method1"
    assert hidden["trial"]["target"] == "glass"
    ended = frame._replace(outcome="wrong_object", grasped="block")
    trial = status(ended, hide=("outcome",))["trial"]
    assert trial["outcome"] == "done" and "grasped" not in trial
    assert status(ended)["trial"]["outcome"] == "wrong_object"


def test_hello_tells_no_method_in_a_blind_study(scene: Scene, frame: Frame):
    """Names of methods and settings stay in the worker."""

    def hello(hide: tuple[str, ...]) -> dict[str, Any]:
        given: dict[str, Any] = {"recorded": True, "hold_on_loss": True, "watch": None}
        return hello_message("abc", scene, frame.view, "policy", {}, hide=hide, **given)

    assert hello(())["methods"][0] == "direct"
    assert [item["colour"] for item in hello(())["scene"]["objects"]] == list(scene.object_names)
    assert hello(())["hold_on_loss"] is True
    blind = json.dumps(hello(("method", "settings")))
    assert "policy" not in blind and "gain" not in blind


@pytest.mark.parametrize("mode", ["translate", "rotate"])
def test_assist_stick_is_the_inverse_of_the_command(frame: Frame, mode: str):
    """The sticks that would command the assistance by themselves, seen from any yaw."""
    for yaw in (0.0, 0.7, -2.0):
        axes = (0.0, 0.4, 0.3, -0.5) if mode == "translate" else (0.4, 0.0, 0.3, -0.5)
        sticks = UserInput(axes=axes, mode=mode, view_yaw=yaw, dead_zone=0.0)  # type: ignore[arg-type]
        record = msgspec.structs.replace(
            frame.record,
            mode=mode,
            view_yaw_rad=yaw,
            assistance_twist=compute_command(sticks, frame.settings).tolist(),
        )
        shown = assist_stick(record, frame.view.settings)
        assert [*shown["left"], *shown["right"]] == pytest.approx(axes, abs=1e-12)


def push_toward(scene: Scene, goal: str, seconds: float, predictor: str = "calibrated"):
    """Frames of a trial in which the person pushes straight at a goal's grasp."""
    settings = preset("default", method="direct", predictor=predictor)
    trial = Trial(KinematicWorld(scene), settings, goal, start_delay_s=0.0)
    g = scene.object_index(goal)
    record = trial.step(UserInput())
    for _ in range(round(seconds * 100)):
        way = trial.goals.positions[record.best_targets[g]] - np.array(record.hand_position_m)
        x, y, z = 0.8 * way / np.abs(way).max()
        record = trial.step(UserInput(axes=(0.0, z, -y, x), dead_zone=0.0))
        yield frame_of(trial, record)


def test_reasons_follow_the_push(scene: Scene):
    """Pushing at the glass: toward it, and away from (or less toward) the canteen."""
    reasons = Reasons()
    told: dict[str, str] = {}
    for frame in push_toward(scene, "glass", 1.0):
        told = reasons.update(frame)
    assert told["glass"] == "you push toward it"
    assert told["canteen"] in ("you push away from it", "you push more toward the glass")


def test_without_input_the_papers_predictor_goes_by_distance(scene: Scene):
    """Near a grasp its belief grows with no push at all; the reason is the distance."""
    frames = list(push_toward(scene, "glass", 2.5, "paper"))
    record = frames[-1].record
    reasons = Reasons()
    told: dict[str, str] = {}
    for k in range(40):
        belief = [0.45 - 0.01 * k, 0.1, 0.45 + 0.01 * k]
        still = msgspec.structs.replace(
            record, time_s=10 + 0.01 * k, direct_twist=[0.0] * 6, belief=belief, phase="running"
        )
        told = reasons.update(frames[-1]._replace(record=still))
    assert told == {"glass": "the hand is near it", "canteen": "the hand is nearer to the glass"}


def test_a_steady_belief_gives_no_reasons_and_a_new_trial_forgets(scene: Scene):
    """Nothing is said of what did not change."""
    reasons = Reasons()
    frames = list(push_toward(scene, "glass", 1.0))
    for frame in frames:
        assert math.isfinite(sum(frame.record.belief))
        reasons.update(frame)
    assert reasons.update(frames[-1])
    view = frames[0].view
    fresh = frames[0]._replace(view=TrialView(**{**_fields(view), "number": 4}))
    assert reasons.update(fresh) == {}


def _fields(view: TrialView) -> dict[str, Any]:
    return {name: getattr(view, name) for name in TrialView.__slots__}
