# pyright: reportAttributeAccessIssue=false
"""The physics of one trial: owns MjModel and MjData, steps them by control ticks."""

from collections.abc import Sequence

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
        # Views into MuJoCo's arrays, which stay where they are for the life of MjData.
        objects = [f"object/{name}" for name in scene.object_names]
        bodies = [int(model.body(name).id) for name in objects]
        self._q, self._v = _joint_views(model, self.data, JOINT_NAMES)
        self._finger_q, self._finger_v = _joint_views(model, self.data, FINGER_NAMES)
        self._object_q = _joint_views(model, self.data, objects)[0].reshape(-1, 7)
        self._centres = self.data.xipos[_row_of(bodies)]
        numbers = np.full(model.nbody, -1)
        numbers[bodies] = np.arange(len(bodies))
        self.geom_object: list[int] = numbers[model.geom_bodyid].tolist()
        site = model.site(HAND_SITE).id
        self._hand_position, self._hand_matrix = (
            self.data.site_xpos[site],
            self.data.site_xmat[site],
        )
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
        self._q[:] = start
        self.data.ctrl[:-1] = start
        for pose, place in zip(self._object_q, self.layout, strict=True):
            spot = self.scene.places[place]
            half_yaw = 0.5 * np.radians(spot.yaw_degrees)
            pose[:] = [
                spot.x_m, spot.y_m, 0.0, np.cos(half_yaw), 0.0, 0.0, np.sin(half_yaw)
            ]  # fmt: skip
        mujoco.mj_forward(self.model, self.data)

    def put_arm(self, joint_positions: Array, finger_travel: float = 0.0) -> None:
        """Place the resting arm elsewhere, without moving there through time.

        Args:
            joint_positions: q [rad], shape (7,).
            finger_travel: Of each finger [m], 0 open.
        """
        self._q[:] = joint_positions
        self._finger_q[:] = finger_travel
        self._v[:] = 0.0
        self._finger_v[:] = 0.0
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
        self._advance()
        # mj_step leaves site and body poses one physics step behind qpos; this refreshes them and
        # touches nothing that the next step starts from.
        mujoco.mj_kinematics(self.model, self.data)

    def _advance(self) -> None:
        """The bare physics of a tick."""
        mujoco.mj_step(self.model, self.data, STEPS_PER_TICK)

    @property
    def time_s(self) -> float:
        """Simulated time since the reset [s]."""
        return float(self.data.time)

    @property
    def joint_positions(self) -> Array:
        """Arm joints q [rad], shape (7,)."""
        return self._q.copy()

    @property
    def joint_velocities(self) -> Array:
        """Arm joints q̇ [rad/s], shape (7,)."""
        return self._v.copy()

    @property
    def finger_positions(self) -> Array:
        """Travel of the left and the right finger [m], 0 open, 0.05 closed, shape (2,)."""
        return self._finger_q.copy()

    @property
    def finger_velocities(self) -> Array:
        """Speed of the fingers [m/s], closing is positive, shape (2,)."""
        return self._finger_v.copy()

    def hand_pose(self) -> Pose:
        """Pose of the tool centre `ee` in the world frame."""
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, self._hand_matrix)
        return Pose(self._hand_position.copy(), quaternion)

    def object_poses(self) -> Array:
        """Per object x y z [m] and the quaternion w x y z, world frame, shape (n_objects, 7)."""
        return self._object_q.copy()

    def object_centres(self) -> Array:
        """Centres of mass of the objects in the world frame [m], shape (n_objects, 3)."""
        return self._centres.copy()

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


def _joint_views(
    model: mujoco.MjModel, data: mujoco.MjData, names: Sequence[str]
) -> tuple[Array, Array]:
    """Views of the positions and the velocities of joints that stand in a row in the model."""
    joints = _row_of([int(model.joint(name).id) for name in names])
    ends = joints.stop < model.njnt
    q_end = model.jnt_qposadr[joints.stop] if ends else model.nq
    v_end = model.jnt_dofadr[joints.stop] if ends else model.nv
    first = joints.start
    return data.qpos[model.jnt_qposadr[first] : q_end], data.qvel[model.jnt_dofadr[first] : v_end]


def _row_of(numbers: list[int]) -> slice:
    """The slice that holds these numbers, in this order.

    Raises:
        RobotError: If they are not in a row: the model was built in another order.
    """
    row = slice(numbers[0], numbers[0] + len(numbers))
    if numbers != list(range(row.start, row.stop)):
        raise RobotError(f"{numbers} of the model are not in a row")
    return row
