"""Names of the components of a step's lists: what `belief[1]` is the belief in."""

from app.recording.fields import fields
from app.recording.schema import TrialHeader

_FIXED: dict[str, tuple[str, ...]] = {
    "axes": ("left_x", "left_y", "right_x", "right_y"),
    "hand_position_m": ("x", "y", "z"),
    "hand_quaternion": ("w", "x", "y", "z"),
}
_TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
_POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
_SHAPES = {line.name: line.shape for line in fields("step")}


def component_names(name: str, length: int, header: TrialHeader) -> tuple[str, ...]:
    """Names of a list field's components, in order; their numbers where nothing else fits.

    Args:
        name: Field of StepRecord.
        length: Number of components in this trial.
        header: Names the trial's goals, joints and objects.
    """
    by_shape: dict[str, tuple[str, ...]] = {
        "n_goals": tuple(header.goal_names),
        "n_joints": tuple(header.joint_names),
        "n_objects × 7": tuple(f"{o}_{part}" for o in header.object_names for part in _POSE),
        "6": _TWIST,
    }
    names = _FIXED.get(name) or by_shape.get(_SHAPES[name], ())
    return names if len(names) == length else tuple(str(index) for index in range(length))
