# pyright: reportAttributeAccessIssue=false
"""From a model's geoms to the GLB files that viser shows, one mesh per body and material."""

from collections.abc import Callable, Iterable

import mujoco
import numpy as np
import numpy.typing as npt

from app.session.drawing.glb import Material, write_glb
from app.session.drawing.shapes import Surface, merge, primitive

CREASE_RAD = 0.55
"""Faces that meet at a sharper angle than this keep a hard edge [rad]."""


def crease_normals(
    vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64], crease: float = CREASE_RAD
) -> npt.NDArray[np.float64]:
    """A unit normal for every corner of every face, shape (n_faces, 3, 3).

    The normal at a corner is the mean, weighted by area, of the normals of those faces round the
    vertex that are within the crease angle of the corner's own face.
    """
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    weighted = np.cross(b - a, c - a)  # length is twice the area
    unit = weighted / np.maximum(np.linalg.norm(weighted, axis=1, keepdims=True), 1e-15)
    # positions, not indices, say which corners meet: files often repeat vertices
    _, vertex = np.unique(np.round(vertices, 7), axis=0, return_inverse=True)
    corner_vertex = vertex.ravel()[faces.ravel()]
    corner_face = np.repeat(np.arange(len(faces)), 3)
    order = np.argsort(corner_vertex, kind="stable")
    starts = np.searchsorted(corner_vertex[order], corner_vertex, side="left")
    counts = np.bincount(corner_vertex)[corner_vertex]
    # every corner against every corner at the same vertex, as one flat list of pairs
    first = np.repeat(np.arange(len(corner_vertex)), counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    second = order[starts[first] + within]
    smooth = np.einsum("ij,ij->i", unit[corner_face[first]], unit[corner_face[second]]) >= np.cos(
        crease
    )
    total = np.zeros((len(corner_vertex), 3))
    np.add.at(total, first[smooth], weighted[corner_face[second[smooth]]])
    length = np.linalg.norm(total, axis=1, keepdims=True)
    fallback = unit[corner_face]
    return np.where(length > 1e-15, total / np.maximum(length, 1e-15), fallback).reshape(-1, 3, 3)


def mesh_geom_surface(model: mujoco.MjModel, geom: int) -> Surface:
    """The mesh of a mesh geom in the geom's own frame, with its texture coordinates."""
    mesh = int(model.geom_dataid[geom])
    start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    first, many = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    vertices = model.mesh_vert[start : start + count].astype(np.float64)
    faces = model.mesh_face[first : first + many].astype(np.int64)
    normals = crease_normals(vertices, faces).reshape(-1, 3)
    corners = vertices[faces.ravel()]
    columns = [corners, normals]
    if model.mesh_texcoordnum[mesh] > 0:
        offset = int(model.mesh_texcoordadr[mesh])
        uv = model.mesh_texcoord[offset + model.mesh_facetexcoord[first : first + many].ravel()]
        columns.append(uv * [1.0, -1.0] + [0.0, 1.0])  # glTF counts v from the top
    table = np.concatenate(columns, axis=1)
    _, kept, index = np.unique(np.round(table, 6), axis=0, return_index=True, return_inverse=True)
    table = table[kept].astype(np.float32)
    return Surface(
        table[:, :3],
        table[:, 3:6],
        index.reshape(-1, 3).astype(np.uint32),
        table[:, 6:8] if table.shape[1] > 6 else None,
    )


def geom_surface(model: mujoco.MjModel, geom: int) -> Surface | None:
    """A geom's mesh in its body's frame, or None for what has no finite shape (planes)."""
    if int(model.geom_type[geom]) == mujoco.mjtGeom.mjGEOM_MESH:
        own = mesh_geom_surface(model, geom)
    else:
        own = primitive(int(model.geom_type[geom]), model.geom_size[geom])
    if own is None:
        return None
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
    return own.moved(model.geom_pos[geom], rotation.reshape(3, 3))


def has_texture_coordinates(model: mujoco.MjModel, geom: int) -> bool:
    """Whether a texture can be laid over a geom."""
    return bool(
        int(model.geom_type[geom]) == mujoco.mjtGeom.mjGEOM_MESH
        and model.mesh_texcoordnum[int(model.geom_dataid[geom])] > 0
    )


def build_glb(
    model: mujoco.MjModel, geoms: Iterable[int], material_of: Callable[[int], Material]
) -> bytes:
    """The geoms as one GLB in their body's frame, merged per material; empty if there is nothing.

    Args:
        model: The model.
        geoms: Ids of geoms that share a body.
        material_of: The material of a geom by its id.
    """
    groups: dict[tuple[Material, bool], list[Surface]] = {}
    for geom in geoms:
        shape = geom_surface(model, geom)
        if shape is not None:
            groups.setdefault((material_of(geom), shape.uvs is not None), []).append(shape)
    if not groups:
        return b""
    return write_glb([(merge(shapes), look) for (look, _), shapes in groups.items()])
