"""The real scene: arm, contacts, inverse kinematics, grasps judged by what happens to them."""

from typing import Literal

import numpy as np

from app.core import Goals, Pose
from app.core.types import Array
from app.robot.arm import JOINT_NAMES, N_CTRL
from app.robot.hand import HandController
from app.robot.kinematics import Kinematics
from app.robot.layouts import random_layout
from app.robot.model import PHYSICS_DT
from app.robot.outcomes import OutcomeMonitor
from app.robot.scene import Scene
from app.robot.servo import Servo
from app.robot.simulation import CONTROL_DT, Simulation
from app.robot.targets import GraspTargets
from app.session.worlds import GoalTracker, Snapshot, Verdict


class PhysicsWorld:
    """Owns the simulation; a tick is one inverse kinematics and five physics steps.

    Attributes:
        scene: What is simulated.
        simulation: The physics, for a viewer's model and for tests.
    """

    kind: Literal["physics"] = "physics"
    joint_names = JOINT_NAMES
    physics_dt_s = PHYSICS_DT

    def __init__(
        self, scene: Scene, seed: int | None = None, simulation: Simulation | None = None
    ) -> None:
        """Build the world and put everything at its start.

        Args:
            scene: What to simulate.
            seed: Draws which object stands where; None: the scene's default.
            simulation: Of this scene, to be used instead of a new one.

        Raises:
            GraspError: If an object cannot be grasped.
        """
        self.scene = scene
        self.simulation = simulation or Simulation(scene)
        self._kinematics = Kinematics(scene)
        self._servo = Servo(self.simulation.joint_positions)
        self._tracker = GoalTracker(scene)
        self._hand = HandController()
        self._monitor = OutcomeMonitor(scene, scene.object_names[0])
        self.reset(seed)

    @property
    def targets(self) -> GraspTargets:
        """Every goal's targets in the frame of its own object."""
        return self._tracker.targets

    @property
    def model_hash(self) -> str:
        """SHA-256 of the compiled model."""
        return self.simulation.model_hash

    def reset(self, seed: int | None) -> None:
        """Put everything at its start; the seed draws which object stands where."""
        layout = None
        if seed is not None:
            layout = random_layout(self.scene, np.random.default_rng(seed))
        self.simulation.reset(layout)
        self._servo.reset(self.simulation.joint_positions)
        self._tracker.reset()
        self._hand = HandController()
        self._ctrl = self.simulation.data.ctrl.copy()
        self._look()

    def begin(self, instructed: str) -> None:
        """Watch for the outcome of a trial with this goal, the hand open."""
        self._monitor = OutcomeMonitor(self.scene, instructed)
        self._hand = HandController()

    def start_state(self) -> list[float]:
        """mjSTATE_INTEGRATION."""
        return self.simulation.get_state().tolist()

    def hand_pose(self) -> Pose:
        """Pose of the site `ee` in the world frame."""
        return self._pose

    def goals(self) -> Goals:
        """The targets in the world frame, where the objects are now."""
        return self._tracker.goals(self._object_poses)

    def close_hand(self) -> None:
        """Let the hand close, and lift what it holds, by itself."""
        self._hand.close()

    def open_hand(self) -> None:
        """Let go."""
        self._hand.open()

    def step(self, twist: Array) -> Array:
        """Move for one control tick."""
        command = self._hand.command()
        taken = twist if command.twist is None else command.twist
        servo = self._servo
        velocity = self._kinematics.solve(servo.reference, servo.velocity, taken, CONTROL_DT)
        ctrl = np.empty(N_CTRL)
        ctrl[:-1] = servo.advance(self._joint_positions, velocity, CONTROL_DT)
        ctrl[-1] = command.finger_ctrl
        self._ctrl = ctrl
        self.simulation.step(ctrl)
        self._look()
        return taken

    def judge(self) -> Verdict:
        """What the outcome's monitor says to the tick."""
        outcome = self._monitor.update(self.simulation, self._hand.closing)
        self._hand.advance(self._monitor)
        return Verdict(outcome, self._hand.phase, self._monitor.gripped_name)

    def snapshot(self) -> Snapshot:
        """The state after the tick."""
        return Snapshot(
            joint_positions=self._joint_positions.tolist(),
            joint_velocities=self.simulation.joint_velocities.tolist(),
            finger_positions=self.simulation.finger_positions.tolist(),
            ctrl=self._ctrl.tolist(),
            object_poses=self._object_poses.ravel().tolist(),
        )

    def _look(self) -> None:
        """Read once a tick what several ask for."""
        self._pose = self.simulation.hand_pose()
        self._joint_positions = self.simulation.joint_positions
        self._object_poses = self.simulation.object_poses()
