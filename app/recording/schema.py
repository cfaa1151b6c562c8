"""What a trial's log holds: one header, one record a tick, events, one summary.

Every message is flat (numbers, strings, lists of numbers), because viewers' JSON-Schema readers
reject nested models; every number is finite. SI units, radians, world frame; quaternions are
w x y z; a twist is [v; ω] with ω applied on the left.
"""

from typing import Literal

import msgspec

Phase = Literal["ready", "running", "closing", "lifting", "done"]
"""ready: arm held at the start pose. running: from the start signal to the command that closes
the hand. closing, lifting: the automatic check of the grasp. done: the outcome is known."""

Outcome = Literal[
    "running",
    "grasped",
    "wrong_object",
    "closed_on_nothing",
    "bad_grip",
    "knocked_over",
    "fell_off",
    "timeout",
    "aborted",
    "interrupted",
]


class TrialHeader(msgspec.Struct, frozen=True, kw_only=True):
    """Everything that is fixed before the first step; written first, topic /trial."""

    schema_version: int = 1
    study: str
    participant: str
    session: str
    trial: int
    attempt: int = 1
    instructed_goal: str
    method: str
    shown_as: str = ""
    seed: int
    scene: str
    scene_json: str
    config_json: str
    config_hash: str
    model_hash: str
    versions_json: str
    started_wall_s: float
    control_dt_s: float
    physics_dt_s: float
    goal_names: list[str]
    object_names: list[str]
    joint_names: list[str]
    target_offsets: list[int]
    target_positions_m: list[float]
    """Targets in their object's frame, flat (n_targets × 3)."""
    target_quaternions: list[float]
    start_state: list[float]
    """mjSTATE_INTEGRATION at the first step; empty in the kinematic world."""


class StepRecord(msgspec.Struct, frozen=True, kw_only=True):
    """One tick of the control loop, topic /step; the viewer, the page and the log read this."""

    step: int
    time_s: float
    """Since the start signal; negative or zero while the arm is held."""
    monotonic_s: float
    wall_s: float
    phase: Phase
    outcome: Outcome
    # the user's input, and everything D(u) depends on
    sequence: int
    client_time_ms: float
    device: str
    axes: list[float]
    buttons: int
    """Bit 0: grasp was commanded in this tick; bit 1: open."""
    mode: str
    dead_zone: float
    view_yaw_rad: float
    input_norm: float
    """‖u‖₂ over all stick axes after the dead zone; full stick is 1."""
    input_s: float
    """∫ ‖u‖₂ dt since the start signal."""
    # the assistance
    method: str
    enabled: bool
    settings_id: int
    """Number of the last "settings" event; its detail holds the settings in full."""
    direct_twist: list[float]
    """D(u)."""
    assistance_twist: list[float]
    """What the method adds: the twist it asks for minus D(u)."""
    known_goal_assistance_twist: list[float]
    """The same had the instructed goal been known."""
    executed_twist: list[float]
    """After gain, magnitude, speed and slew limits: what the kinematics was given."""
    belief: list[float]
    values: list[float]
    q_values: list[float]
    best_targets: list[int]
    """Per goal the row of the target it would be grasped at."""
    # the world after this tick
    hand_position_m: list[float]
    hand_quaternion: list[float]
    joint_positions_rad: list[float]
    joint_velocities_rad_s: list[float]
    finger_positions_m: list[float]
    ctrl: list[float]
    """What the actuators were given in this tick, float64: re-simulation reads this."""
    object_poses: list[float]
    """Per object x y z qw qx qy qz, flat."""
    # health
    lateness_s: float
    round_trip_ms: float


class TrialEvent(msgspec.Struct, frozen=True, kw_only=True):
    """Something that happened once, topic /event."""

    time_s: float
    wall_s: float
    step: int
    name: str
    """start, settings, method, assist, grasp, open, blur, focus, hidden, visible, input_lost,
    disconnect, reconnect, late, outcome, note, …"""
    detail: str = ""
    """JSON text, or empty."""


class TrialSummary(msgspec.Struct, frozen=True, kw_only=True):
    """How the trial ended, topic /summary; missing where the worker died before the end."""

    outcome: Outcome
    duration_s: float
    """From the start signal to the command that closed the hand."""
    input_s: float
    inferred_goal: str
    """The most probable goal at the end."""
    grasped_object: str = ""
    steps: int
    late_steps: int
    ended_wall_s: float
    recovered: bool = False
