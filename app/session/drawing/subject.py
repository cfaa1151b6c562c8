# pyright: reportAttributeAccessIssue=false
"""What is drawn: a MuJoCo model and which of its bodies are the robot, the objects, the table."""

from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from app.errors import AppError
from app.session.drawing.materials import code_of, geom_rgba, is_visible

TABLE = "table"
"""Name of the geom that gets a table's legs."""
OBJECT_PREFIX = "object/"
"""Put before an object's name in a model, so that it meets no part of the robot."""


class SubjectError(AppError):
    """A model that cannot be drawn as a robot with objects."""


@dataclass(frozen=True, slots=True)
class Subject:
    """A model, sorted into what the view treats differently.

    Attributes:
        model: The compiled model; the view keeps its own MjData beside it.
        object_names: Objects in the order of StepRecord.object_poses.
        robot_bodies: Ids of the robot's bodies, parents before children.
        joint_addresses: qpos address of each arm joint, in StepRecord.joint_positions_rad's order.
        finger_addresses: The same for StepRecord.finger_positions_m.
        static_geoms: Ids of geoms fixed to the world.
        hand_site: Id of the site whose frame is the hand's pose.
    """

    model: mujoco.MjModel
    object_names: tuple[str, ...]
    robot_bodies: tuple[int, ...]
    joint_addresses: npt.NDArray[np.int64]
    finger_addresses: npt.NDArray[np.int64]
    static_geoms: tuple[int, ...]
    hand_site: int

    def object_geoms(self, name: str) -> list[int]:
        """Ids of the visible geoms of an object, in the model's order."""
        body = _object_body(self.model, name)
        start, count = int(self.model.body_geomadr[body]), int(self.model.body_geomnum[body])
        return [g for g in range(start, start + count) if is_visible(self.model, g)]

    def object_colour(self, name: str) -> str:
        """Colour of an object's first visible geom, its main surface, as #RRGGBB."""
        geoms = self.object_geoms(name)
        return code_of(*geom_rgba(self.model, geoms[0])[:3]) if geoms else "#808080"


def _object_body(model: mujoco.MjModel, name: str) -> int:
    """Id of an object's body, `object/<name>` or in a foreign model `<name>`; −1 if none."""
    for full in (f"{OBJECT_PREFIX}{name}", name):
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, full)
        if body >= 0:
            return body
    return -1


def _ancestors(model: mujoco.MjModel, body: int) -> set[int]:
    """A body and everything between it and the world."""
    chain = set()
    while body != 0:
        chain.add(body)
        body = int(model.body_parentid[body])
    return chain


def subject_of(
    model: mujoco.MjModel,
    object_names: tuple[str, ...] | None = None,
    hand_site: str = "ee",
) -> Subject:
    """Sort a model's bodies by what they are, for any robot.

    The robot is the tree that carries the hand's site. Joints between the world and the hand are
    the arm's, all others of that tree are the fingers'. Objects are bodies with a free joint.

    Args:
        model: A compiled model.
        object_names: The objects in recorded order; None takes all free bodies in model order.
        hand_site: Name of the site whose frame is the hand's pose.

    Raises:
        SubjectError: If the site or an object does not exist in the model.
    """
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, hand_site)
    if site < 0:
        valid = ", ".join(model.site(i).name for i in range(model.nsite)) or "none"
        raise SubjectError(f"the model has no site {hand_site!r}; it has: {valid}")
    hand_body = int(model.site_bodyid[site])
    chain = _ancestors(model, hand_body)
    root = int(model.body_rootid[hand_body])
    robot = tuple(b for b in range(1, model.nbody) if int(model.body_rootid[b]) == root)
    arm, fingers = [], []
    for joint in range(model.njnt):
        body = int(model.jnt_bodyid[joint])
        if body in robot and int(model.jnt_type[joint]) in (
            mujoco.mjtJoint.mjJNT_HINGE,
            mujoco.mjtJoint.mjJNT_SLIDE,
        ):
            (arm if body in chain else fingers).append(int(model.jnt_qposadr[joint]))
    free = tuple(
        model.body(int(model.jnt_bodyid[j])).name.removeprefix(OBJECT_PREFIX)
        for j in range(model.njnt)
        if int(model.jnt_type[j]) == mujoco.mjtJoint.mjJNT_FREE
    )
    names = free if object_names is None else object_names
    for name in names:
        if _object_body(model, name) < 0:
            raise SubjectError(
                f"the model has no object {name!r}; free bodies are: {', '.join(free) or 'none'}"
            )
    return Subject(
        model=model,
        object_names=names,
        robot_bodies=robot,
        joint_addresses=np.array(arm, dtype=np.int64),
        finger_addresses=np.array(fingers, dtype=np.int64),
        static_geoms=tuple(g for g in range(model.ngeom) if model.geom_bodyid[g] == 0),
        hand_site=site,
    )
