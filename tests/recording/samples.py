"""Records to write: realistic in size, different in every step."""

from typing import Any

import numpy as np

from app.recording.schema import StepRecord, TrialEvent, TrialHeader, TrialSummary

GOALS = ["glass", "cup", "bowl"]
JOINTS = [f"joint{i}" for i in range(1, 8)]


def make_header(**changes: Any) -> TrialHeader:
    """A header with every field filled."""
    known: dict[str, Any] = {
        "study": "demo",
        "participant": "p0001",
        "session": "s1",
        "trial": 1,
        "instructed_goal": "glass",
        "method": "policy",
        "shown_as": "A",
        "seed": 7,
        "scene": "default",
        "scene_json": '{"name":"default"}',
        "config_json": '{"method":"policy"}',
        "config_hash": "c0ffee",
        "model_hash": "beef",
        "versions_json": '{"hindsight":"0.1.0"}',
        "started_wall_s": 1.75e9,
        "control_dt_s": 0.01,
        "physics_dt_s": 0.002,
        "goal_names": GOALS,
        "object_names": GOALS,
        "joint_names": JOINTS,
        "target_offsets": [0, 1, 2, 3],
        "target_positions_m": [0.1] * 9,
        "target_quaternions": [1.0, 0.0, 0.0, 0.0] * 3,
        "start_state": [0.1] * 60,
    }
    return TrialHeader(**(known | changes))


def make_step(number: int, **changes: Any) -> StepRecord:
    """A step whose numbers fill all 53 bits, a pure function of its number."""
    rng = np.random.default_rng(number)

    def numbers(count: int) -> list[float]:
        return rng.normal(size=count).tolist()

    belief = rng.dirichlet(np.ones(len(GOALS))).tolist()
    known: dict[str, Any] = {
        "step": number,
        "time_s": number * 0.01,
        "monotonic_s": 1000 + number * 0.01,
        "wall_s": 1.75e9 + number * 0.01,
        "phase": "running",
        "outcome": "running",
        "sequence": number * 3,
        "client_time_ms": number * 10.0,
        "device": "gamepad",
        "axes": numbers(4),
        "buttons": 0,
        "mode": "translate",
        "dead_zone": 0.1,
        "view_yaw_rad": 0.3,
        "input_norm": abs(numbers(1)[0]),
        "input_s": number * 0.005,
        "method": "policy",
        "enabled": True,
        "settings_id": 0,
        "direct_twist": numbers(6),
        "assistance_twist": numbers(6),
        "known_goal_assistance_twist": numbers(6),
        "executed_twist": numbers(6),
        "belief": belief,
        "values": numbers(3),
        "q_values": numbers(3),
        "best_targets": [0, 1, 2],
        "hand_position_m": numbers(3),
        "hand_quaternion": numbers(4),
        "joint_positions_rad": numbers(7),
        "joint_velocities_rad_s": numbers(7),
        "finger_positions_m": numbers(2),
        "ctrl": numbers(8),
        "object_poses": numbers(21),
        "lateness_s": 0.0002,
        "round_trip_ms": 23.0,
    }
    return StepRecord(**(known | changes))


def make_event(step: int, name: str = "blur") -> TrialEvent:
    """An event in a step."""
    return TrialEvent(time_s=step * 0.01, wall_s=1.75e9 + step * 0.01, step=step, name=name)


def make_summary(**changes: Any) -> TrialSummary:
    """A summary of a good trial."""
    known: dict[str, Any] = {
        "outcome": "grasped",
        "duration_s": 12.5,
        "input_s": 4.25,
        "inferred_goal": "glass",
        "grasped_object": "glass",
        "steps": 200,
        "late_steps": 1,
        "ended_wall_s": 1.75e9 + 20,
    }
    return TrialSummary(**(known | changes))
