"""A pose of the arm for trials in which the hand moved alone, so that there is a robot to see."""

import msgspec
import numpy as np

from app.recording.schema import StepRecord
from app.review.replay import Replay
from app.robot.inverse import PoseSolver
from app.robot.rotations import matrices


class ArmPoser:
    """Finds joint positions for logs that have none; the solver is made when it is needed."""

    def __init__(self) -> None:
        self._solver: PoseSolver | None = None

    def record(self, replay: Replay, step: int) -> StepRecord:
        """One step as it was recorded, with an arm in any case."""
        record = replay.record(step)
        if record.joint_positions_rad:
            return record
        if self._solver is None:
            self._solver = PoseSolver()
        start = np.array(replay.scene.start_joint_positions)
        turn = matrices(np.array([record.hand_quaternion]))[0]
        found = self._solver.solve(np.array(record.hand_position_m), turn, start)
        joints = (start if found is None else found).tolist()
        fingers = record.finger_positions_m or [0.0, 0.0]
        return msgspec.structs.replace(
            record, joint_positions_rad=joints, finger_positions_m=fingers
        )
