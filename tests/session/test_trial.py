"""Laws of a trial: phases, measures, settings, determinism, in a world without physics."""

import json

import numpy as np
import pytest

from app.core import METHODS, AssistanceSettings, UserInput, preset, settings_from_dict
from app.recording.schema import StepRecord
from app.robot.scene import Scene
from app.session.commands import Command, CommandError
from app.session.kinematic_world import KinematicWorld
from app.session.stamps import Stamps
from app.session.trial import Trial

PUSH = UserInput(axes=(0.0, -0.1, 0.2, 0.8), device="test")
REST = UserInput(device="test")


def make(scene: Scene, method: str = "policy", **options) -> Trial:
    """A trial without physics for the glass."""
    return Trial(KinematicWorld(scene, 1), preset("default", method=method), "glass", **options)


def run(trial: Trial, user_input: UserInput, ticks: int, **stamps) -> list[StepRecord]:
    """Some ticks with the same input."""
    return [trial.step(user_input, (), Stamps(**stamps)) for _ in range(ticks)]


def test_the_arm_is_held_until_the_start_signal(scene: Scene):
    """Auto: half a second; input: the first push; signal: the command. Nothing moves before."""
    for start, begin in (
        ("auto", lambda trial: run(trial, PUSH, 50)),
        ("input", lambda trial: run(trial, REST, 200)),
        ("signal", lambda trial: run(trial, PUSH, 200)),
    ):
        trial = make(scene, start=start)
        pose = trial.world.hand_pose().position.copy()
        held = begin(trial)
        assert {record.phase for record in held} == {"ready"}
        assert all(record.time_s <= 0.0 for record in held)
        assert np.array_equal(trial.world.hand_pose().position, pose)
        if start == "signal":
            trial.command(Command("start"))
        first = trial.step(PUSH)
        assert (first.phase, first.time_s) == ("running", 0.0)
        assert [e.name for e in trial.take_events()][-1] == "start"
        assert run(trial, PUSH, 1)[0].time_s == pytest.approx(0.01)


def test_time_and_input_count_from_start_to_grasp(scene: Scene):
    """What is pushed before the start and after the closing command does not count."""
    trial = make(scene)
    records = run(trial, PUSH, 150)
    pushed = records[-1].input_norm
    assert pushed == pytest.approx(np.hypot(0.0, np.hypot(0.2, 0.8)) / 0.9 - 0.1 / 0.9, rel=1e-9)
    grasp = trial.step(PUSH, [Command("grasp")])
    assert (grasp.phase, grasp.buttons) == ("closing", 1)
    run(trial, PUSH, 50)
    summary = trial.summary()
    assert summary.duration_s == pytest.approx(1.0)
    assert summary.input_s == pytest.approx(1.0 * pushed)
    assert trial.phase == "done" and summary.outcome == "closed_on_nothing"


def test_a_done_trial_holds_and_the_hand_opens(scene: Scene):
    """No input moves the arm; `open` is recorded; a second grasp needs a new trial."""
    trial = make(scene)
    run(trial, PUSH, 80)
    trial.step(PUSH, [Command("grasp")])
    record = run(trial, PUSH, 20)[-1]
    assert (record.phase, record.outcome) == ("done", "closed_on_nothing")
    assert record.executed_twist == [0.0] * 6
    opened = trial.step(REST, [Command("open")])
    assert opened.buttons == 2 and opened.finger_positions_m == [0.0, 0.0]
    with pytest.raises(CommandError, match="valid: while it is running"):
        trial.step(REST, [Command("grasp")])
    assert trial.tick == 102  # a refused command is no tick


def test_the_clock_runs_out(scene: Scene):
    """After the limit the outcome is timeout, and the duration is the limit."""
    trial = make(scene, timeout_s=1.0)
    run(trial, REST, 200)
    assert trial.summary().outcome == "timeout"
    assert trial.summary().duration_s == pytest.approx(1.0)
    unlimited = make(scene, timeout_s=0.0)
    run(unlimited, REST, 7000)
    assert unlimited.phase == "running"
    assert unlimited.summary().outcome == "aborted"


def test_every_change_of_settings_is_recorded_in_full(scene: Scene):
    """Each step names the settings it was made under, and those can be restored exactly."""
    trial = make(scene, "policy")
    run(trial, PUSH, 60)
    commands = [
        Command("settings", {"changes": {"gain": 0.75, "predictor": "paper"}}),
        Command("method", {"method": "blend"}),
        Command("assist", {"enabled": False}),
    ]
    records = [trial.step(PUSH, [command]) for command in commands]
    assert [record.settings_id for record in records] == [2, 3, 4]
    assert [record.method for record in records] == ["policy", "blend", "blend"]
    assert records[-1].enabled is False
    events = [e for e in trial.take_events() if e.name == "settings"]
    details = [json.loads(e.detail) for e in events]
    assert [detail["id"] for detail in details] == [1, 2, 3, 4]
    assert settings_from_dict(details[-1]["settings"]) == trial.settings
    assert details[1]["settings"]["gain"] == 0.75
    assert details[0]["settings"]["gain"] == 1.0


def test_a_bad_setting_changes_nothing(scene: Scene):
    """The error names value and valid ones; settings, state and log stay as they were."""
    trial = make(scene)
    trial.take_events()
    for command, text in (
        (Command("settings", {"changes": {"gain": 3.0}}), "gain"),
        (Command("settings", {"changes": {"gian": 1.0}}), "gian"),
        (Command("method", {"method": "magic"}), "valid: direct, blend"),
        (Command("camera", {"preset": "top"}), "no command of a trial"),
    ):
        with pytest.raises(CommandError, match=text):
            trial.command(command)
    assert trial.settings == preset("default", method="policy")
    assert trial.take_events() == []


def test_yielding_brings_its_gain_and_takes_it_away(scene: Scene):
    """A method's own default follows it, but never overrides what a person has set."""
    trial = make(scene, "policy")
    trial.command(Command("method", {"method": "yielding"}))
    assert trial.settings.gain == preset("default", method="yielding").gain != 1.0
    trial.command(Command("method", {"method": "blend"}))
    assert trial.settings.gain == 1.0
    trial.command(Command("settings", {"changes": {"gain": 0.5}}))
    trial.command(Command("method", {"method": "yielding"}))
    assert trial.settings.gain == 0.5


@pytest.mark.parametrize("method", list(METHODS))
def test_equal_trials_are_equal_to_the_last_bit(scene: Scene, method: str):
    """Same world, seed and inputs: same records."""

    def trial_records() -> list[StepRecord]:
        trial = make(scene, method, seed=1)
        rng = np.random.default_rng(5)
        inputs = [UserInput(axes=tuple(rng.uniform(-1, 1, 4)), device="t") for _ in range(200)]
        return [trial.step(user_input) for user_input in inputs]

    assert trial_records() == trial_records()


def test_policy_goes_on_without_input_but_a_stop_holds(scene: Scene):
    """Lost input leaves the arm to the method; hold-on-loss and `hold` bring it to rest."""
    free, held, halted = make(scene), make(scene, hold_on_loss=True), make(scene)
    for trial in (free, held, halted):
        run(trial, PUSH, 100)
    halted.command(Command("hold"))
    moving = run(free, REST, 60, loss="silent")[-1]
    stopped = run(held, REST, 60, loss="silent")[-1]
    halt = run(halted, REST, 60)[-1]
    assert np.linalg.norm(moving.executed_twist[:3]) > 0.01
    assert stopped.executed_twist == halt.executed_twist == [0.0] * 6
    assert "input_lost" in [e.name for e in held.take_events()]
    assert np.linalg.norm(run(held, PUSH, 30)[-1].executed_twist[:3]) > 0.05
    assert np.linalg.norm(run(halted, PUSH, 30)[-1].executed_twist[:3]) > 0.05


def test_assistance_is_what_the_method_adds(scene: Scene):
    """Direct adds nothing; with the goal known, policy heads for it whatever the belief."""
    assert not any(run(make(scene, "direct"), PUSH, 80)[-1].assistance_twist)
    trial = make(scene, "policy", start_delay_s=0.0)
    record = trial.step(REST)
    goal = trial.goals.positions[record.best_targets[2]]
    way = goal - np.array(trial.world.hand_pose().position)
    assert np.array(record.known_goal_assistance_twist[:3]) @ way > 0.9 * np.linalg.norm(
        record.known_goal_assistance_twist[:3]
    ) * np.linalg.norm(way)
    plain = make(scene, "policy", start_delay_s=0.0, with_known_goal=False).step(REST)
    assert plain.known_goal_assistance_twist == [0.0] * 6
    assert plain.executed_twist == record.executed_twist


def test_counterfactuals_name_every_method(scene: Scene):
    """And the method in use would have done what it did, before the limits."""
    trial = make(scene, "policy")
    record = run(trial, PUSH, 120)[-1]
    would = trial.counterfactuals()
    assert set(would) == set(METHODS)
    assert would["direct"].tolist() == record.direct_twist
    did = np.array(record.direct_twist) + np.array(record.assistance_twist)
    assert would["policy"] == pytest.approx(did, abs=1e-12)


def test_the_header_restores_the_beginning(scene: Scene):
    """Scene, settings, targets and names are complete; equal settings have equal hashes."""
    trial = make(scene)
    header = trial.header()
    assert Scene.model_validate_json(header.scene_json) == scene
    config = json.loads(header.config_json)
    assert settings_from_dict(config["settings"]) == trial.settings
    assert config["timeout_s"] == scene.time_limit_s
    assert len(header.target_positions_m) == 3 * header.target_offsets[-1]
    assert len(header.target_quaternions) == 4 * header.target_offsets[-1]
    assert header.goal_names == list(scene.object_names)
    assert header.config_hash == make(scene).header().config_hash
    assert header.config_hash != make(scene, "blend").header().config_hash
    assert json.loads(header.versions_json)["hindsight"]


def test_an_unknown_target_names_the_valid_ones(scene: Scene):
    """The error says which objects there are."""
    with pytest.raises(CommandError, match="'teapot'; valid: canteen, block, glass"):
        Trial(KinematicWorld(scene), AssistanceSettings(), "teapot")


def test_late_and_lost_ticks_are_recorded(scene: Scene):
    """Each step holds its lateness; lost ticks are an event; both count in the summary."""
    trial = make(scene)
    trial.step(REST, (), Stamps(lateness_s=0.004))
    record = trial.step(REST, (), Stamps(lateness_s=0.007))
    trial.step(REST, (), Stamps(lateness_s=0.032, skipped=3))
    assert record.lateness_s == 0.007
    late = [e for e in trial.take_events() if e.name == "late"]
    assert [json.loads(e.detail)["skipped"] for e in late] == [3]
    assert trial.summary().late_steps == 2
