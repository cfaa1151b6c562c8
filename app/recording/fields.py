"""The data dictionary: unit, frame, shape and meaning of every recorded field.

One table serves the JSON schemas inside the logs, the dictionary beside every export, and the
documentation. Shapes name their lengths: lists are recorded flat, so `n_objects × 7` is a list of
7 n_objects numbers, row after row.
"""

import typing
from typing import Any

import msgspec

from app.recording.schema import StepRecord, TrialEvent, TrialHeader, TrialSummary


class Field(msgspec.Struct, frozen=True, kw_only=True):
    """One line of the data dictionary."""

    record: str
    """"trial", "step", "event" or "summary": the topic without its slash."""
    name: str
    type: str
    """"text", "integer", "number", "true or false", or "list of" one of these."""
    shape: str
    """Lengths of a list, row-major; empty for a single value."""
    unit: str
    frame: str
    description: str


RECORDS: dict[str, type[msgspec.Struct]] = {
    "trial": TrialHeader,
    "step": StepRecord,
    "event": TrialEvent,
    "summary": TrialSummary,
}
"""Record name → its struct, in the order of a log."""

_TYPE_NAMES = {str: "text", int: "integer", float: "number", bool: "true or false"}

# name → (unit, frame, shape, description)
_Line = tuple[str, str, str, str]

_TRIAL: dict[str, _Line] = {
    "schema_version": ("", "", "", "Version of this record format."),
    "study": ("", "", "", "Name of the study."),
    "participant": ("", "", "", "Pseudonym of the participant; no personal data."),
    "session": ("", "", "", "Name of the participant's session."),
    "trial": ("", "", "", "Number of the trial within the session, from 1."),
    "attempt": ("", "", "", "1 for the first attempt at this trial, counting up when repeated."),
    "instructed_goal": ("", "", "", "Object the participant was told to grasp."),
    "method": ("", "", "", "Assistance method at the start."),
    "shown_as": ("", "", "", "Name under which the method was shown to the participant."),
    "seed": ("", "", "", "Seed of the layout and of everything random in the trial."),
    "scene": ("", "", "", "Name of the scene."),
    "scene_json": ("", "", "", "The scene in full, JSON text."),
    "config_json": ("", "", "", "The settings in full at the start, JSON text."),
    "config_hash": ("", "", "", "Hash of the settings."),
    "model_hash": ("", "", "", "Hash of the physics model."),
    "versions_json": ("", "", "", "Versions of the program and its libraries, JSON text."),
    "started_wall_s": ("s", "", "", "Unix time at which the log was opened."),
    "control_dt_s": ("s", "", "", "Duration of one control tick."),
    "physics_dt_s": ("s", "", "", "Duration of one physics step."),
    "goal_names": ("", "", "n_goals", "Goals, in the order of every per-goal list."),
    "object_names": ("", "", "n_objects", "Objects, in the order of object_poses."),
    "joint_names": ("", "", "n_joints", "Arm joints, in the order of every per-joint list."),
    "target_offsets": ("", "", "n_goals + 1", "First target row of each goal, and the end."),
    "target_positions_m": ("m", "object", "n_targets × 3", "Grasp targets' positions."),
    "target_quaternions": ("", "object", "n_targets × 4", "Grasp targets' orientations, w x y z."),
    "start_state": ("", "", "n_state", "Physics state at the first step (mjSTATE_INTEGRATION)."),
}

_STEP: dict[str, _Line] = {
    "step": ("", "", "", "Number of the tick within the trial."),
    "time_s": ("s", "", "", "Time since the start signal; not above zero while the arm is held."),
    "monotonic_s": ("s", "", "", "Monotonic clock of the machine."),
    "wall_s": ("s", "", "", "Unix time."),
    "phase": ("", "", "", "ready, running, closing, lifting or done."),
    "outcome": ("", "", "", "Outcome so far; running until it is known."),
    "sequence": ("", "", "", "Number of the input message in force; 0 without one."),
    "client_time_ms": ("ms", "", "", "The browser's clock when the input was sampled."),
    "device": ("", "", "", "Input device, or the name of a simulated user."),
    "axes": ("", "stick", "4", "Left x, left y, right x, right y before the dead zone; ±1."),
    "buttons": ("", "", "", "Commands in this tick: bit 0 grasp, bit 1 open."),
    "mode": ("", "", "", "What the sticks command: translate or rotate."),
    "dead_zone": ("", "stick", "", "Radius of each stick that counts as rest; full stick is 1."),
    "view_yaw_rad": ("rad", "world", "", "Heading of the operator's view about z; 0 is +x."),
    "input_norm": ("", "stick", "", "‖u‖₂ after the dead zone; full stick is 1."),
    "input_s": ("s", "stick", "", "∫ ‖u‖₂ dt since the start signal."),
    "method": ("", "", "", "Assistance method in force."),
    "enabled": ("", "", "", "Whether assistance is switched on."),
    "settings_id": ("", "", "", "Number of the settings event in force."),
    "direct_twist": ("m/s, rad/s", "world", "6", "D(u): what the user alone commands; [v; ω]."),
    "assistance_twist": ("m/s, rad/s", "world", "6", "Twist the method asks for minus D(u)."),
    "known_goal_assistance_twist": (
        *("m/s, rad/s", "world", "6"),
        "Assistance there would have been had the instructed goal been known.",
    ),
    "executed_twist": ("m/s, rad/s", "world", "6", "Twist after all limits, given to the arm."),
    "belief": ("", "", "n_goals", "Probability of each goal."),
    "values": ("nat", "", "n_goals", "Cost-to-go V of each goal."),
    "q_values": ("nat", "", "n_goals", "Cost-to-go Q of each goal given the user's input."),
    "best_targets": ("", "", "n_goals", "Target row each goal would be grasped at."),
    "hand_position_m": ("m", "world", "3", "Position of the hand's site after the tick."),
    "hand_quaternion": ("", "world", "4", "Orientation of the hand's site, w x y z."),
    "joint_positions_rad": ("rad", "joint", "n_joints", "Positions of the arm's joints."),
    "joint_velocities_rad_s": ("rad/s", "joint", "n_joints", "Velocities of the arm's joints."),
    "finger_positions_m": ("m", "joint", "n_fingers", "Positions of the fingers."),
    "ctrl": ("", "actuator", "n_actuators", "What the actuators were given in this tick."),
    "object_poses": ("m, –", "world", "n_objects × 7", "Per object x y z and quaternion w x y z."),
    "lateness_s": ("s", "", "", "How late the tick began."),
    "round_trip_ms": ("ms", "", "", "Round-trip time to the browser, last measured."),
}

_EVENT: dict[str, _Line] = {
    "time_s": ("s", "", "", "Time since the start signal."),
    "wall_s": ("s", "", "", "Unix time."),
    "step": ("", "", "", "Tick in which it happened."),
    "name": ("", "", "", "What happened: start, settings, grasp, blur, disconnect, ..."),
    "detail": ("", "", "", "JSON text, or empty."),
}

_SUMMARY: dict[str, _Line] = {
    "outcome": ("", "", "", "How the trial ended."),
    "duration_s": ("s", "", "", "From the start signal to the command that closed the hand."),
    "input_s": ("s", "stick", "", "∫ ‖u‖₂ dt over that time; full stick is 1."),
    "inferred_goal": ("", "", "", "The most probable goal at the end."),
    "grasped_object": ("", "", "", "Object in the hand at the end, or empty."),
    "steps": ("", "", "", "Number of ticks recorded."),
    "late_steps": ("", "", "", "Number of ticks that began late."),
    "ended_wall_s": ("s", "", "", "Unix time of the end."),
    "recovered": ("", "", "", "True where the log was completed after its process had died."),
}

_LINES = {"trial": _TRIAL, "step": _STEP, "event": _EVENT, "summary": _SUMMARY}


def element_type(annotation: Any) -> tuple[type, bool]:
    """Python type of a field's single value, and whether the field is a list of them."""
    if typing.get_origin(annotation) is list:
        return typing.get_args(annotation)[0], True
    if typing.get_origin(annotation) is typing.Literal:
        return str, False
    return annotation, False


def fields(record: str | None = None) -> tuple[Field, ...]:
    """The data dictionary, of one record ("trial", "step", "event", "summary") or of all."""
    names = tuple(RECORDS) if record is None else (record,)
    return tuple(_field(name, info) for name in names for info in _infos(name))


def _infos(record: str) -> tuple[msgspec.structs.FieldInfo, ...]:
    return msgspec.structs.fields(RECORDS[record])


def _field(record: str, info: msgspec.structs.FieldInfo) -> Field:
    kind, is_list = element_type(info.type)
    # A field added to the schema before its line here must not stop a log from being written;
    # a test demands the line.
    unit, frame, shape, description = _LINES[record].get(info.name, ("", "", "", info.name))
    return Field(
        record=record,
        name=info.name,
        type=("list of " if is_list else "") + _TYPE_NAMES[kind],
        shape=shape,
        unit=unit,
        frame=frame,
        description=description,
    )
