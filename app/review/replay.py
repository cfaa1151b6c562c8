"""A finished trial, step by step: its records, its goals in the world, its settings."""

from functools import cached_property
from typing import Any

import msgspec
import numpy as np

from app.core import AssistanceSettings, Goals, Pose, UserInput, settings_from_dict
from app.core.types import Array
from app.recording.columns import TrialLog
from app.recording.schema import StepRecord
from app.review.errors import ReviewError
from app.robot.scene import Scene
from app.robot.targets import GraspTargets, goals_in_world


class Replay:
    """Reads a log as the trial wrote it; holds nothing but the log.

    Attributes:
        log: The trial.
        header: What was fixed before its first step.
    """

    def __init__(self, log: TrialLog) -> None:
        """Take a trial; what asks for a column that was not loaded raises KeyError.

        Raises:
            ReviewError: If it has no steps.
        """
        if log.n_steps == 0:
            raise ReviewError(f"{log.path} holds no steps: the trial ended before it began")
        self.log = log
        self.header = log.header

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return self.log.n_steps

    @property
    def physical(self) -> bool:
        """Whether an arm moved, not the hand alone."""
        return len(self.header.start_state) > 0

    @cached_property
    def scene(self) -> Scene:
        """What stood there."""
        return Scene.model_validate_json(self.header.scene_json)

    @cached_property
    def targets(self) -> GraspTargets:
        """The grasps of the trial, each in its object's frame."""
        header = self.header
        offsets = np.array(header.target_offsets, dtype=np.int64)
        rows = [header.object_names.index(name) for name in header.goal_names]
        return GraspTargets(
            tuple(header.goal_names),
            np.array(header.target_positions_m).reshape(-1, 3),
            np.array(header.target_quaternions).reshape(-1, 4),
            offsets,
            np.repeat(np.array(rows, dtype=np.int64), np.diff(offsets)),
        )

    @cached_property
    def start_step(self) -> int:
        """The first step of the running trial; 0 where it never ran."""
        running = np.flatnonzero(self.log.steps["phase"] != "ready")
        return int(running[0]) if len(running) else 0

    @cached_property
    def seconds(self) -> Array:
        """Time since the start signal [s], also before it and where it never came, (n_steps,)."""
        return (self.log.steps["step"] - self.start_step) * self.header.control_dt_s

    @cached_property
    def settings_by_id(self) -> dict[int, AssistanceSettings]:
        """The settings under each number that steps refer to.

        Raises:
            CoreError: If this program does not know a setting of the log.
        """
        found: dict[int, AssistanceSettings] = {}
        for event in self.log.events:
            if event.name == "settings" and event.detail:
                detail = msgspec.json.decode(event.detail)
                found[detail["id"]] = settings_from_dict(detail["settings"])
        if not found:
            config = msgspec.json.decode(self.header.config_json)
            found[1] = settings_from_dict(config["settings"])
        return found

    @cached_property
    def config(self) -> dict[str, Any]:
        """The trial's rules and first settings, as the header holds them."""
        return msgspec.json.decode(self.header.config_json)

    def settings(self, step: int) -> AssistanceSettings:
        """The settings in force at a step."""
        known = self.settings_by_id
        number = int(self.log.steps["settings_id"][step])
        return known.get(number) or known[min(known)]

    def record(self, step: int) -> StepRecord:
        """One step as it was recorded."""
        values: dict[str, Any] = {n: c[step].tolist() for n, c in self.log.steps.items()}
        return StepRecord(**values)

    def pose(self, step: int) -> Pose:
        """The hand after a step."""
        steps = self.log.steps
        return Pose(steps["hand_position_m"][step], steps["hand_quaternion"][step])

    def object_poses(self, step: int) -> Array:
        """The objects after a step, x y z qw qx qy qz each, (n_objects, 7)."""
        return self.log.steps["object_poses"][step].reshape(-1, 7)

    def goals(self, step: int) -> Goals:
        """The targets in the world after a step."""
        return goals_in_world(self.targets, self.object_poses(step))

    def user_input(self, step: int) -> UserInput:
        """What the person did at a step."""
        steps = self.log.steps
        x, y, z, w = steps["axes"][step].tolist()
        return UserInput(
            axes=(x, y, z, w),
            mode=str(steps["mode"][step]),  # type: ignore[arg-type]
            view_yaw=float(steps["view_yaw_rad"][step]),
            dead_zone=float(steps["dead_zone"][step]),
            device=str(steps["device"][step]),
            sequence=int(steps["sequence"][step]),
            client_time=float(steps["client_time_ms"][step]),
        )

    def clamp(self, step: int) -> int:
        """The nearest step there is."""
        return min(max(step, 0), self.n_steps - 1)
