# pyright: reportAttributeAccessIssue=false
"""The physics of one trial: owns MjModel and MjData, steps them by control ticks."""

import mujoco
import numpy as np

from app.core.types import Array, Pose
from app.robot.arm import FINGER_NAMES, HAND_SITE, JOINT_NAMES, N_CTRL
from app.robot.errors import RobotError
from app.robot.layouts import random_layout
from app.robot.model import PHYSICS_DT, build_model, model_hash
from app.robot.scene import Layout, Scene

CONTROL_DT = 0.01  # [s]
STEPS_PER_TICK = round(CONTROL_DT / PHYSICS_DT)
STATE = mujoco.mjtState.mjSTATE_INTEGRATION
"""The only state re-simulation may start from: FULLPHYSICS lacks the solver's warm start."""


class Simulation:
    """MuJoCo's world of a scene: the arm at its start pose, the objects at their places.

    Equal scenes, states and ctrl give bit-identical results, in this process and in any other.

    Attributes:
        scene: What is simulated.
        layout: Place of each object at the last reset.
        model: The compiled model; do not change it.
        data: MuJoCo's data, owned by this object.
        model_hash: SHA-256 of the compiled model.
        geom_object: For each geom the number of the object it is part of, or −1.
    """

    def __init__(
        self, scene: Scene, *, seed: int | None = None, layout: Layout | None = None
    ) -> None:
        """Build the world.

        Args:
            scene: What to simulate.
            seed: Draws a random layout where none is given; None: the default layout.
            layout: Place of each object.

        Raises:
            SceneError: If the layout does not fit the scene.
        """
        self.scene = scene
        self.model = build_model(scene)
        self.data = mujoco.MjData(self.model)
        self.model_hash = model_hash(self.model)
        model = self.model
        self._joint_q = np.array([model.joint(name).qposadr[0] for name in JOINT_NAMES])
        self._joint_v = np.array([model.joint(name).dofadr[0] for name in JOINT_NAMES])
        self._finger_q = np.array([model.joint(name).qposadr[0] for name in FINGER_NAMES])
        self._finger_v = np.array([model.joint(name).dofadr[0] for name in FINGER_NAMES])
        first = [model.joint(f"object/{name}").qposadr[0] for name in scene.object_names]
        self._object_q = np.array(first)[:, None] + np.arange(7)
        self._bodies = np.array([model.body(f"object/{name}").id for name in scene.object_names])
        numbers = np.full(model.nbody, -1)
        numbers[self._bodies] = np.arange(len(self._bodies))
        self.geom_object: list[int] = numbers[model.geom_bodyid].tolist()
        self._site = model.site(HAND_SITE).id
        self._state_size = mujoco.mj_stateSize(model, STATE)
        self.layout: Layout = ()
        if layout is None and seed is not None:
            layout = random_layout(scene, np.random.default_rng(seed))
        self.reset(layout)

    def reset(self, layout: Layout | None = None) -> None:
        """Put the arm at its start pose and the objects at their places, all at rest.

        Raises:
            SceneError: If the layout does not fit the scene.
        """
        self.layout = self.scene.checked_layout(layout)
        mujoco.mj_resetData(self.model, self.data)
        start = self.scene.start_joint_positions
        self.data.qpos[self._joint_q] = start
        self.data.ctrl[:-1] = start
        for columns, place in zip(self._object_q, self.layout, strict=True):
            spot = self.scene.places[place]
            half_yaw = 0.5 * np.radians(spot.yaw_degrees)
            self.data.qpos[columns] = [
                spot.x_m, spot.y_m, 0.0, np.cos(half_yaw), 0.0, 0.0, np.sin(half_yaw)
            ]  # fmt: skip
        mujoco.mj_forward(self.model, self.data)

    def put_arm(self, joint_positions: Array, finger_travel: float = 0.0) -> None:
        """Place the resting arm elsewhere, without moving there through time.

        Args:
            joint_positions: q [rad], shape (7,).
            finger_travel: Of each finger [m], 0 open.
        """
        self.data.qpos[self._joint_q] = joint_positions
        self.data.qpos[self._finger_q] = finger_travel
        self.data.qvel[self._joint_v] = 0.0
        self.data.qvel[self._finger_v] = 0.0
        mujoco.mj_kinematics(self.model, self.data)

    def step(self, ctrl: Array) -> None:
        """Advance one control tick: 5 physics steps of 2 ms under one constant ctrl.

        Args:
            ctrl: Joint position servos [rad] and the grip [m], float64, shape (8,).

        Raises:
            RobotError: If ctrl has another shape or is not finite.
        """
        if np.shape(ctrl) != (N_CTRL,) or not np.isfinite(ctrl).all():
            raise RobotError(f"ctrl {ctrl!r} is not valid; valid: {N_CTRL} finite numbers")
        self.data.ctrl[:] = ctrl
        mujoco.mj_step(self.model, self.data, STEPS_PER_TICK)
        # mj_step leaves site and body poses one physics step behind qpos; this refreshes them and
        # touches nothing that the next step starts from.
        mujoco.mj_kinematics(self.model, self.data)

    @property
    def time_s(self) -> float:
        """Simulated time since the reset [s]."""
        return float(self.data.time)

    @property
    def joint_positions(self) -> Array:
        """Arm joints q [rad], shape (7,)."""
        return self.data.qpos[self._joint_q]

    @property
    def joint_velocities(self) -> Array:
        """Arm joints q̇ [rad/s], shape (7,)."""
        return self.data.qvel[self._joint_v]

    @property
    def finger_positions(self) -> Array:
        """Travel of the left and the right finger [m], 0 open, 0.05 closed, shape (2,)."""
        return self.data.qpos[self._finger_q]

    @property
    def finger_velocities(self) -> Array:
        """Speed of the fingers [m/s], closing is positive, shape (2,)."""
        return self.data.qvel[self._finger_v]

    def hand_pose(self) -> Pose:
        """Pose of the tool centre `ee` in the world frame."""
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, self.data.site_xmat[self._site])
        return Pose(self.data.site_xpos[self._site].copy(), quaternion)

    def object_poses(self) -> Array:
        """Per object x y z [m] and the quaternion w x y z, world frame, shape (n_objects, 7)."""
        return self.data.qpos[self._object_q]

    def object_centres(self) -> Array:
        """Centres of mass of the objects in the world frame [m], shape (n_objects, 3)."""
        return self.data.xipos[self._bodies]

    def get_state(self) -> Array:
        """Everything the next step depends on (mjSTATE_INTEGRATION), one float64 vector."""
        state = np.empty(self._state_size)
        mujoco.mj_getState(self.model, self.data, state, STATE)
        return state

    def set_state(self, state: Array) -> None:
        """Return to a state of `get_state`; stepping goes on bit-identically from there.

        Raises:
            RobotError: If the vector has another length or is not finite.
        """
        vector = np.ascontiguousarray(state, dtype=np.float64)
        if vector.shape != (self._state_size,) or not np.isfinite(vector).all():
            raise RobotError(
                f"a state of shape {vector.shape} does not fit; valid: {self._state_size} finite "
                "numbers from get_state() of the same model"
            )
        mujoco.mj_setState(self.model, self.data, vector, STATE)
        mujoco.mj_kinematics(self.model, self.data)
