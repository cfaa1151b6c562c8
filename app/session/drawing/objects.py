# pyright: reportAttributeAccessIssue=false
"""The objects: opaque and translucent parts of each, and a hidden frame above it for its tag."""

from collections.abc import Sequence

import mujoco
import numpy as np
import viser

from app.session.drawing.glb import Material
from app.session.drawing.materials import geom_rgba, object_material
from app.session.drawing.meshes import build_glb, geom_surface, has_texture_coordinates
from app.session.drawing.outbox import Outbox
from app.session.drawing.subject import Subject

TAG_LIFT_M = 0.035  # [m] from an object's highest point to its tag


class ObjectNodes:
    """Nodes `/hindsight/object/<name>`, with `/tag/<name>` above each.

    Translucent parts are a node of their own because shadows are set per node: glass casts none.
    """

    def __init__(self, server: viser.ViserServer, subject: Subject, outbox: Outbox):
        self._subject, self._outbox = subject, outbox
        self._frames: list[viser.FrameHandle] = []
        self._tags: list[viser.FrameHandle] = []
        self._corners: list[np.ndarray] = []
        self._last: tuple[float, ...] | None = None
        model = subject.model
        for name in subject.object_names:
            geoms = subject.object_geoms(name)
            root = f"/hindsight/object/{name}"
            self._frames.append(server.scene.add_frame(root, show_axes=False))
            self._tags.append(server.scene.add_frame(f"/tag/{name}", show_axes=False))
            self._corners.append(_bounding_corners(model, geoms))

            def material_of(geom: int) -> Material:
                return object_material(model, geom, has_texture_coordinates(model, geom))

            solid = [g for g in geoms if geom_rgba(model, g)[3] >= 1.0]
            clear = [g for g in geoms if geom_rgba(model, g)[3] < 1.0]
            if data := build_glb(model, solid, material_of):
                server.scene.add_glb(f"{root}/solid", data)
            if data := build_glb(model, clear, material_of):
                server.scene.add_glb(f"{root}/clear", data, cast_shadow=False, receive_shadow=False)

    def update(self, object_poses: Sequence[float]) -> None:
        """Move the objects and their tags.

        Args:
            object_poses: Per object x y z qw qx qy qz in the world, flat, as in the record.
        """
        flat = tuple(object_poses)
        if flat == self._last:
            return
        self._last = flat
        poses = np.asarray(flat, dtype=np.float64).reshape(-1, 7)
        rotation = np.empty(9)
        for pose, frame, tag, corners in zip(
            poses, self._frames, self._tags, self._corners, strict=True
        ):
            self._outbox.place(frame, pose[:3], pose[3:])
            mujoco.mju_quat2Mat(rotation, pose[3:])
            top = float((corners @ rotation.reshape(3, 3)[2]).max())
            self._outbox.place(tag, pose[:3] + [0.0, 0.0, top + TAG_LIFT_M])

    def hide(self) -> None:
        """Draw no objects; they are still there."""
        for frame in (*self._frames, *self._tags):
            self._outbox.put(frame, "visible", False)

    def set_tags_visible(self, visible: bool) -> None:
        """Show or hide the frames that tags hang on."""
        for tag in self._tags:
            self._outbox.put(tag, "visible", visible)

    @property
    def positions(self) -> np.ndarray:
        """Where the objects were last drawn [m], shape (n_objects, 3)."""
        if self._last is None:
            return np.zeros((len(self._frames), 3))
        return np.asarray(self._last).reshape(-1, 7)[:, :3]


def _bounding_corners(model: mujoco.MjModel, geoms: list[int]) -> np.ndarray:
    """Corners of the box round the geoms in their body's frame [m], shape (8, 3)."""
    shapes = [s for g in geoms if (s := geom_surface(model, g)) is not None]
    if not shapes:
        return np.zeros((8, 3))
    low = np.min([s.vertices.min(axis=0) for s in shapes], axis=0)
    high = np.max([s.vertices.max(axis=0) for s in shapes], axis=0)
    return np.stack(np.meshgrid(*np.stack([low, high], axis=1)), axis=-1).reshape(8, 3)
