# pyright: reportAttributeAccessIssue=false
"""The robot: a tree of frames that repeats the model's bodies, moved joint by joint."""

from collections.abc import Sequence

import mujoco
import numpy as np
import viser

from app.session.drawing.glb import Material
from app.session.drawing.materials import is_visible, model_material, robot_surfaces
from app.session.drawing.meshes import build_glb, has_texture_coordinates
from app.session.drawing.outbox import Outbox
from app.session.drawing.palette import Theme
from app.session.drawing.subject import Subject

ROOT = "/hindsight/arm"


class RobotNodes:
    """Nodes of the robot's bodies, each inside its parent's.

    A link's pose in its parent's frame changes by its own joint alone, so a turn of one joint is
    one short message, where poses in the world would be two for every link beyond it.
    """

    def __init__(self, server: viser.ViserServer, subject: Subject, theme: Theme, outbox: Outbox):
        self._server, self._subject, self._outbox = server, subject, outbox
        self._data = mujoco.MjData(subject.model)
        self._frames: dict[int, viser.FrameHandle] = {}
        self._meshes: dict[int, viser.GlbHandle] = {}
        self._last: tuple[tuple[float, ...], tuple[float, ...]] | None = None
        model, names = subject.model, {}
        for body in subject.robot_bodies:
            parent = names.get(int(model.body_parentid[body]), ROOT)
            names[body] = f"{parent}/{model.body(body).name or f'body-{body}'}"
            self._frames[body] = server.scene.add_frame(
                names[body],
                show_axes=False,
                position=tuple(model.body_pos[body]),
                wxyz=tuple(model.body_quat[body]),
            )
        self.set_theme(theme)
        mujoco.mj_kinematics(model, self._data)
        self._send()

    def set_theme(self, theme: Theme) -> None:
        """Build the bodies' meshes in a theme's materials."""
        model, named = self._subject.model, robot_surfaces(theme)

        def material_of(geom: int) -> Material:
            material = int(model.geom_matid[geom])
            own = named.get(model.mat(material).name) if material >= 0 else None
            return own or model_material(model, geom, has_texture_coordinates(model, geom))

        for body, frame in self._frames.items():
            start = int(model.body_geomadr[body])
            geoms = range(start, start + int(model.body_geomnum[body])) if start >= 0 else ()
            data = build_glb(model, [g for g in geoms if is_visible(model, g)], material_of)
            if not data:
                continue
            if body in self._meshes:
                self._meshes[body].glb_data = data
            else:
                self._meshes[body] = self._server.scene.add_glb(f"{frame.name}/mesh", data)

    def update(self, joint_positions: Sequence[float], finger_positions: Sequence[float]) -> None:
        """Pose the robot.

        Args:
            joint_positions: Arm joints [rad], as in StepRecord.joint_positions_rad.
            finger_positions: Finger joints [m], as in StepRecord.finger_positions_m.
        """
        posture = (tuple(joint_positions), tuple(finger_positions))
        if posture == self._last:
            return
        self._last = posture
        subject, qpos = self._subject, self._data.qpos
        qpos[subject.joint_addresses] = joint_positions
        qpos[subject.finger_addresses] = finger_positions
        mujoco.mj_kinematics(subject.model, self._data)
        self._send()

    def hand_pose(self) -> tuple[np.ndarray, np.ndarray]:
        """The hand's pose in the world as drawn: position (3,) [m], rotation matrix (3, 3)."""
        site = self._subject.hand_site
        return self._data.site_xpos[site].copy(), self._data.site_xmat[site].reshape(3, 3).copy()

    def _send(self) -> None:
        """Send the pose in its parent's frame of every body that has a joint."""
        model, data = self._subject.model, self._data
        inverse, turn = np.empty(4), np.empty(4)
        offset = np.empty(3)
        for body, frame in self._frames.items():
            parent = int(model.body_parentid[body])
            if model.body_jntnum[body] == 0:
                continue
            mujoco.mju_negQuat(inverse, data.xquat[parent])
            mujoco.mju_mulQuat(turn, inverse, data.xquat[body])
            mujoco.mju_rotVecQuat(offset, data.xpos[body] - data.xpos[parent], inverse)
            self._outbox.place(frame, offset, turn)
