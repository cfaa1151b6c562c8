# pyright: reportAttributeAccessIssue=false
"""Where the robot means to grasp: a ghost of the gripper at the best target of likely goals."""

from collections.abc import Sequence

import mujoco
import numpy as np
import trimesh
import viser

from app.core.types import Goals
from app.session.drawing.materials import is_visible
from app.session.drawing.meshes import mesh_geom_surface
from app.session.drawing.outbox import Outbox
from app.session.drawing.palette import Theme, marker
from app.session.drawing.subject import Subject

LEAST_PROBABILITY = 0.25
MOST = 2
FILL_PER_PROBABILITY = 0.6
EDGE_RAD = 0.6  # edges sharper than this are drawn [rad]
OPACITY_STEP = 0.06
SEGMENTS = 32


def likely_goals(belief: Sequence[float]) -> list[int]:
    """The goals that get a ghost, the most probable first: p ≥ 0.25, at most two."""
    order = sorted(range(len(belief)), key=lambda g: -belief[g])
    return [g for g in order[:MOST] if belief[g] >= LEAST_PROBABILITY]


def gripper_mesh(subject: Subject) -> trimesh.Trimesh:
    """The open gripper in the frame of the hand's site: plain shapes, hulls of meshes.

    Parts are those of the site's body and of all bodies it carries, at the model's qpos0.
    """
    model, data = subject.model, mujoco.MjData(subject.model)
    mujoco.mj_kinematics(model, data)
    hand = int(model.site_bodyid[subject.hand_site])
    bodies = {hand}
    for body in subject.robot_bodies:
        if int(model.body_parentid[body]) in bodies:
            bodies.add(body)
    turn = data.site_xmat[subject.hand_site].reshape(3, 3)
    origin = data.site_xpos[subject.hand_site]
    parts: list[trimesh.Trimesh] = []
    for geom in range(model.ngeom):
        if int(model.geom_bodyid[geom]) not in bodies or not is_visible(model, geom):
            continue
        part = _plain(model, geom)
        if part is None:
            continue
        pose = np.eye(4)
        pose[:3, :3] = turn.T @ data.geom_xmat[geom].reshape(3, 3)
        pose[:3, 3] = turn.T @ (data.geom_xpos[geom] - origin)
        parts.append(part.apply_transform(pose))
    if not parts:
        return trimesh.Trimesh()
    starts = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=True)]
    return trimesh.Trimesh(
        np.concatenate([part.vertices for part in parts]), np.concatenate(faces), process=False
    )


def _plain(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh | None:
    """A geom without fillets, so that its edges are few and sharp, in its own frame."""
    size = model.geom_size[geom]
    match int(model.geom_type[geom]):
        case mujoco.mjtGeom.mjGEOM_BOX:
            return trimesh.creation.box(2.0 * size)
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return trimesh.creation.cylinder(size[0], 2.0 * size[1], sections=SEGMENTS)
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            return trimesh.creation.capsule(2.0 * size[1], size[0], count=[SEGMENTS, SEGMENTS])
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return trimesh.creation.icosphere(3, size[0])
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            return trimesh.creation.icosphere(3, 1.0).apply_scale(size)
        case mujoco.mjtGeom.mjGEOM_MESH:
            return trimesh.convex.convex_hull(mesh_geom_surface(model, geom).vertices)
        case _:
            return None


def sharp_edges(mesh: trimesh.Trimesh, least: float = EDGE_RAD) -> np.ndarray:
    """Line segments along the edges whose faces meet at more than this angle [rad], (n, 2, 3)."""
    edges = mesh.face_adjacency_edges[mesh.face_adjacency_angles > least]
    return np.asarray(mesh.vertices[edges], dtype=np.float32).reshape(-1, 2, 3)


class GhostNodes:
    """Nodes `/hindsight/ghost/<goal>`, made when a goal first becomes likely, then moved."""

    def __init__(self, server: viser.ViserServer, subject: Subject, theme: Theme, outbox: Outbox):
        self._scene, self._subject, self._outbox = server.scene, subject, outbox
        self._theme = theme
        self._mesh = gripper_mesh(subject)
        self._edges = sharp_edges(self._mesh)
        self._fills: dict[str, viser.MeshHandle] = {}
        self._outlines: dict[str, viser.LineSegmentsHandle] = {}

    def set_theme(self, theme: Theme) -> None:
        """Put existing ghosts into a theme's colours."""
        self._theme = theme
        for name, fill in self._fills.items():
            colour = marker(theme, self._subject.object_colour(name))
            fill.color = colour
            self._outlines[name].colors = np.array(colour, dtype=np.uint8)

    def update(
        self, goals: Goals | None, belief: Sequence[float], best_targets: Sequence[int]
    ) -> None:
        """Show the ghosts of the likely goals and hide the others.

        Args:
            goals: The goals with their targets in the world, or None to hide all ghosts.
            belief: Probability of each goal, shape (n_goals,).
            best_targets: Row of `goals` of the target each goal would be grasped at, (n_goals,).
        """
        shown = likely_goals(belief) if goals is not None else []
        names = [goals.names[g] for g in shown] if goals is not None else []
        for name, fill in self._fills.items():
            if name not in names:
                self._outbox.put(fill, "visible", False)
        if goals is None:
            return
        for rank, goal in enumerate(shown):
            name, target = goals.names[goal], int(best_targets[goal])
            if name not in self._fills:
                self._make(name)
            fill, outline = self._fills[name], self._outlines[name]
            self._outbox.place(fill, goals.positions[target], goals.quaternions[target])
            opacity = FILL_PER_PROBABILITY * belief[goal]
            self._outbox.put(fill, "opacity", round(opacity / OPACITY_STEP) * OPACITY_STEP)
            self._outbox.put(fill, "visible", True)
            self._outbox.put(outline, "visible", rank == 0)

    def _make(self, name: str) -> None:
        colour = marker(self._theme, self._subject.object_colour(name))
        self._fills[name] = self._scene.add_mesh_simple(
            f"/hindsight/ghost/{name}",
            np.asarray(self._mesh.vertices, dtype=np.float32),
            np.asarray(self._mesh.faces, dtype=np.uint32),
            color=colour,
            opacity=FILL_PER_PROBABILITY,
            flat_shading=True,
            cast_shadow=False,
            receive_shadow=False,
        )
        self._outlines[name] = self._scene.add_line_segments(
            f"/hindsight/ghost/{name}/edges",
            self._edges,
            colour,
            thickness=1.6,
            thickness_units="screen",
        )
