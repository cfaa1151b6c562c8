"""A scripted operator: drives the hand through points or to poses, closes it, tells the outcome."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]

from app.core.types import Array
from app.recording.schema import Outcome
from app.robot import (
    CONTROL_DT,
    HandController,
    Kinematics,
    OutcomeMonitor,
    Scene,
    Servo,
    Simulation,
)

LEVEL = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""R_world_ee of the level hand that points along +x."""


@dataclass
class Rig:
    """A simulation with all that moves its arm."""

    scene: Scene
    sim: Simulation
    goal: str
    kin: Kinematics = field(init=False)
    servo: Servo = field(init=False)
    hand: HandController = field(init=False)
    monitor: OutcomeMonitor = field(init=False)
    ctrl_log: list[Array] = field(default_factory=list)
    finger_limit: float = 1.0

    def __post_init__(self) -> None:
        self.kin = Kinematics(self.scene)
        self.servo = Servo(self.sim.joint_positions)
        self.hand = HandController()
        self.monitor = OutcomeMonitor(self.scene, self.goal)

    def tick(self, twist: Array) -> Outcome:
        """One control tick under the operator's twist, or the hand's own."""
        command = self.hand.command()
        wanted = twist if command.twist is None else command.twist
        velocity = self.kin.solve(self.servo.reference, self.servo.velocity, wanted, CONTROL_DT)
        joints = self.servo.advance(self.sim.joint_positions, velocity, CONTROL_DT)
        ctrl = np.append(joints, min(command.finger_ctrl, self.finger_limit))
        self.ctrl_log.append(ctrl)
        self.sim.step(ctrl)
        outcome = self.monitor.update(self.sim, self.hand.closing)
        self.hand.advance(self.monitor)
        return outcome

    def go(self, points: Sequence[Array], speed: float = 0.2, limit_s: float = 15.0) -> bool:
        """Push the hand through points [m] by translation alone; False where it does not arrive."""
        waiting = [np.asarray(point, dtype=float) for point in points]
        for _ in range(round(limit_s / CONTROL_DT)):
            way = waiting[0] - self.sim.hand_pose().position
            distance = float(np.linalg.norm(way))
            if distance < 0.003:
                waiting.pop(0)
                if not waiting:
                    return True
                continue
            pace = min(speed, 3.0 * distance + 0.01)
            self.tick(np.concatenate([way / distance * pace, np.zeros(3)]))
            if self.monitor.outcome != "running":
                return False
        return False

    def go_to_pose(self, position: Array, rotation: Array, limit_s: float = 8.0) -> bool:
        """Move to a pose along a straight line, turning on the way."""
        for _ in range(round(limit_s / CONTROL_DT)):
            pose = self.sim.hand_pose()
            w, x, y, z = pose.quaternion
            turn = pin.log3(rotation @ pin.Quaternion(w, x, y, z).toRotationMatrix().T)
            way = position - pose.position
            if np.linalg.norm(way) < 0.002 and np.linalg.norm(turn) < 0.01:
                return True
            twist = 4.0 * np.concatenate([way, turn])
            twist[:3] *= min(1.0, 0.15 / max(float(np.linalg.norm(twist[:3])), 1e-9))
            twist[3:] *= min(1.0, 0.8 / max(float(np.linalg.norm(twist[3:])), 1e-9))
            self.tick(twist)
            if self.monitor.outcome != "running":
                return False
        return False

    def wait(self, seconds: float) -> Outcome:
        """Keep the hand where it is."""
        for _ in range(round(seconds / CONTROL_DT)):
            if self.tick(np.zeros(6)) != "running":
                break
        return self.monitor.outcome

    def grasp(self, limit_s: float = 6.0) -> Outcome:
        """Close the hand and let it check its grip."""
        self.hand.close()
        return self.wait(limit_s)


def level_way(point: Array, height: float) -> list[Array]:
    """Points by which a level hand comes to an object: aside, down in front of it, forward."""
    x, y = float(point[0]), float(point[1])
    before = min(x - 0.12, 0.57 if abs(y) < 0.1 else 0.52)
    return [np.array([0.56, y, 0.22]), np.array([before, y, height]), np.array([x, y, height])]
