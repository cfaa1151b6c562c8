"""Errors of the robot room that a user can mend."""

from app.errors import AppError


class RobotError(AppError):
    """A bad value given to the simulation, the kinematics or a monitor."""


class SceneError(AppError):
    """A scene file that cannot be used; the message names file, line, field and valid values."""


class GraspError(AppError):
    """No usable grasp of an object where the scene puts it."""
