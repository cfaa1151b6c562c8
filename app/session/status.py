"""From a frame to the page's status message; what a study hides never leaves the worker."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from app.recording.schema import StepRecord
from app.session.frame import Frame

Message = dict[str, Any]


def assist_stick(record: StepRecord, settings: Mapping[str, Any]) -> dict[str, list[float]]:
    """What assistance adds, in the frame of the sticks: the inverse of D(u), full stick is 1."""
    v = record.assistance_twist
    cos, sin = math.cos(record.view_yaw_rad), math.sin(record.view_yaw_rad)
    if record.mode == "rotate":
        full = float(settings["full_stick_angular_speed"])
        right = [v[3] * cos + v[4] * sin, -v[3] * sin + v[4] * cos]
        left = [-v[5], 0.0]
    else:
        full = float(settings["full_stick_speed"])
        right = [v[0] * sin - v[1] * cos, v[0] * cos + v[1] * sin]
        left = [0.0, v[2]]
    return {"left": [x / full for x in left], "right": [x / full for x in right]}


def object_centres(frame: Frame) -> dict[str, list[float]]:
    """Where a person sees each object [m]: the middle of its height, not the footprint's centre."""
    centres = {}
    poses = np.reshape(frame.record.object_poses, (-1, 7)).tolist()
    for name, height, pose in zip(
        frame.view.object_names, frame.view.object_heights_m, poses, strict=True
    ):
        x, y, z, qw, qx, qy, qz = pose
        up = (2 * (qx * qz + qw * qy), 2 * (qy * qz - qw * qx), 1 - 2 * (qx * qx + qy * qy))
        centres[name] = [p + 0.5 * height * u for p, u in zip((x, y, z), up, strict=True)]
    return centres


def status_message(
    frame: Frame,
    *,
    layers: Mapping[str, Any],
    camera: str,
    value_range: Sequence[float] | None,
    reasons: Mapping[str, str],
    hide: Sequence[str] = (),
) -> Message:
    """The `status` message of the contract.

    Args:
        frame: The newest tick.
        layers: The drawn layers.
        camera: Name of the camera preset.
        value_range: Lowest and highest value on the drawn slice [nat]; None: no slice.
        reasons: Goal → why its probability changed last.
        hide: What must not reach the browser, of `spec.HIDEABLE`; whole fields are left out.
    """
    record, view, health = frame.record, frame.view, frame.health
    leading = int(np.argmax(record.belief))
    trial: Message = {
        "number": view.number,
        "target": view.target,
        "method": record.method,
        "shown_as": view.shown_as,
        "phase": record.phase,
        "outcome": frame.outcome,
        "seconds": round(frame.seconds, 3),
        "input": round(record.input_s, 4),
        "grasped": frame.grasped,
        "scene": view.scene,
        "seed": view.seed,
        "simulated": view.simulated,
    }
    message: Message = {
        "type": "status",
        "trial": trial,
        "belief": dict(zip(view.goal_names, record.belief, strict=True)),
        "hand": record.hand_position_m,
        "hand_quaternion": record.hand_quaternion,
        "objects": object_centres(frame),
        "direct": record.direct_twist,
        "assistance": record.assistance_twist,
        "executed": record.executed_twist,
        "assist_stick": assist_stick(record, view.settings),
        "sticks": {
            "left": record.axes[:2],
            "right": record.axes[2:],
            "mode": record.mode,
            "yaw": record.view_yaw_rad,
        },
        "loss": frame.loss,
        "loop": {
            "hz": round(health.hz, 1),
            "late": health.late,
            "lateness_ms": round(health.lateness_ms, 2),
        },
        "settings": view.settings,
        "settings_id": record.settings_id,
        "layers": layers,
        "camera": camera,
        "value_range": None if value_range is None else list(value_range),
        "leading_target": record.best_targets[leading],
        "reason": dict(reasons),
    }
    redact(message, hide)
    return message


_FIELDS: dict[str, tuple[str, ...]] = {
    "belief": ("belief", "reason", "value_range", "leading_target"),
    "assistance": ("assistance", "assist_stick", "executed"),
    "method": ("settings", "settings_id"),
    "positions": ("hand", "hand_quaternion", "objects"),
    "settings": ("settings", "settings_id"),
    "loop": ("loop",),
    "outcome": (),
}
_TRIAL_FIELDS: dict[str, tuple[str, ...]] = {
    "method": ("method",),
    "outcome": ("grasped",),
}


def redact(message: Message, hide: Sequence[str]) -> None:
    """Take out of a `status` or `hello` what a study hides."""
    trial = message.get("trial")
    for part in hide:
        for field in _FIELDS[part]:
            message.pop(field, None)
        if part == "method":
            message.pop("methods", None)
        if isinstance(trial, dict):
            for field in _TRIAL_FIELDS.get(part, ()):
                trial.pop(field, None)
            if part == "outcome" and trial.get("outcome") not in (None, "running"):
                trial["outcome"] = "done"
