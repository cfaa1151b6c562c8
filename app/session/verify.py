"""Does a log's physics repeat? Re-simulate a trial from its logged controls, bit for bit."""

from collections.abc import Iterable
from dataclasses import dataclass

import msgspec
import numpy as np

from app.errors import AppError
from app.recording.schema import StepRecord, TrialHeader
from app.robot.scene import Scene
from app.robot.simulation import CONTROL_DT, Simulation
from app.session.header import PHYSICS_PACKAGES, versions


class VerifyError(AppError):
    """A log that cannot be re-simulated here; the message says why."""


@dataclass(frozen=True, slots=True)
class Difference:
    """The first place where re-simulation and log part.

    Attributes:
        step: Number of the step.
        field: Field of the step record.
        logged: Its value in the log.
        simulated: Its value in re-simulation.
    """

    step: int
    field: str
    logged: list[float]
    simulated: list[float]

    def __str__(self) -> str:
        gap = np.abs(np.array(self.logged) - np.array(self.simulated)).max()
        return f"step {self.step}: {self.field} differs by up to {gap:.3g}"


def resimulate(header: TrialHeader, steps: Iterable[StepRecord]) -> Difference | None:
    """Step the physics through the logged controls.

    Args:
        header: The trial's header.
        steps: Its steps, from the first on, without a gap.

    Returns:
        The first difference, however small; None where every logged state repeats exactly.

    Raises:
        VerifyError: If the trial was made without physics, with another version of the physics
            library or another model, or if steps are missing.
    """
    simulation = _simulation(header)
    for number, step in enumerate(steps):
        if step.step != number:
            raise VerifyError(f"step {number} is missing: the log goes on with step {step.step}")
        simulation.step(np.array(step.ctrl))
        difference = _compare(step, simulation)
        if difference is not None:
            return difference
    return None


def _simulation(header: TrialHeader) -> Simulation:
    """The simulation at the trial's first state."""
    if not header.start_state:
        raise VerifyError("the trial was made without physics; valid: trials of the physics world")
    made_with = msgspec.json.decode(header.versions_json, type=dict[str, str])
    for package in (*PHYSICS_PACKAGES, "machine"):
        logged, here = made_with.get(package, "unknown"), versions()[package]
        if logged != here:
            raise VerifyError(f"the trial was made with {package} {logged}, here is {here}")
    if header.control_dt_s != CONTROL_DT:
        raise VerifyError(f"a tick took {header.control_dt_s} s; valid: {CONTROL_DT} s")
    simulation = Simulation(Scene.model_validate_json(header.scene_json))
    if simulation.model_hash != header.model_hash:
        raise VerifyError(
            f"the trial's model is {header.model_hash[:12]}…, this program builds "
            f"{simulation.model_hash[:12]}… from the same scene"
        )
    simulation.set_state(np.array(header.start_state))
    return simulation


def _compare(step: StepRecord, simulation: Simulation) -> Difference | None:
    hand = simulation.hand_pose()
    simulated = {
        "joint_positions_rad": simulation.joint_positions,
        "joint_velocities_rad_s": simulation.joint_velocities,
        "finger_positions_m": simulation.finger_positions,
        "object_poses": simulation.object_poses().ravel(),
        "hand_position_m": hand.position,
        "hand_quaternion": hand.quaternion,
    }
    for field, value in simulated.items():
        logged: list[float] = getattr(step, field)
        if logged != value.tolist():
            return Difference(step.step, field, logged, value.tolist())
    return None
