# pyright: reportAttributeAccessIssue=false
"""Triangle meshes of MuJoCo's primitive geoms, with rounded edges and exact normals.

A hard edge catches no light and makes a part look like a diagram; a fillet of 4 mm gives it the
highlight that a real housing has. Normals are those of the surface itself, so curves stay smooth
at 40 segments and flat faces stay flat.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

FILLET_M = 0.004  # [m]
SEGMENTS = 40
ARC_STEPS = 3  # facets of a fillet

F32 = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Surface:
    """One triangle mesh.

    Attributes:
        vertices: Positions [m], shape (n, 3).
        normals: Unit normals, shape (n, 3).
        faces: Vertex indices, counter-clockwise from outside, shape (m, 3), uint32.
        uvs: Texture coordinates with the origin at the top left, shape (n, 2), or None.
    """

    vertices: F32
    normals: F32
    faces: npt.NDArray[np.uint32]
    uvs: F32 | None = None

    def moved(self, position: npt.ArrayLike, rotation: npt.ArrayLike) -> "Surface":
        """The same mesh in a frame where its own has this position (3,) and rotation (3, 3)."""
        turn = np.asarray(rotation, dtype=np.float64)
        return Surface(
            (self.vertices @ turn.T + np.asarray(position)).astype(np.float32),
            (self.normals @ turn.T).astype(np.float32),
            self.faces,
            self.uvs,
        )


def merge(surfaces: list[Surface]) -> Surface:
    """Join meshes into one; texture coordinates stay where every part has them."""
    offsets = np.cumsum([0] + [len(s.vertices) for s in surfaces[:-1]])
    uvs = [s.uvs for s in surfaces if s.uvs is not None]
    return Surface(
        np.concatenate([s.vertices for s in surfaces]),
        np.concatenate([s.normals for s in surfaces]),
        np.concatenate(
            [s.faces + np.uint32(o) for s, o in zip(surfaces, offsets, strict=True)]
        ).astype(np.uint32),
        np.concatenate(uvs) if len(uvs) == len(surfaces) else None,
    )


def _grid_faces(rows: int, columns: int) -> npt.NDArray[np.uint32]:
    """Two triangles per cell of a grid of rows × columns vertices, normal along columns × rows."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    a = (i * columns + j).ravel()
    b, c, d = a + 1, a + columns + 1, a + columns
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]).astype(
        np.uint32
    )


def revolve(profile: npt.ArrayLike, normals: npt.ArrayLike, segments: int = SEGMENTS) -> Surface:
    """Turn a profile about z.

    Args:
        profile: Points (radius, z) from bottom to top [m], shape (n, 2).
        normals: Their outward normals (radial, z), shape (n, 2).
        segments: Corners of the resulting circle.
    """
    points, directions = np.asarray(profile, float), np.asarray(normals, float)
    angle = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    cosine, sine = np.cos(angle), np.sin(angle)

    def turned(pairs: npt.NDArray[np.float64]) -> F32:
        radial, z = pairs[:, :1], pairs[:, 1:]
        grid = np.stack(
            [radial * cosine, radial * sine, np.broadcast_to(z, (len(z), segments + 1))]
        )
        return grid.transpose(1, 2, 0).reshape(-1, 3).astype(np.float32)

    return Surface(turned(points), turned(directions), _grid_faces(len(points), segments + 1))


def _arc(start: float, stop: float, steps: int) -> npt.NDArray[np.float64]:
    """Unit vectors (cos, sin) from one angle [rad] to another, shape (steps + 1, 2)."""
    angle = np.linspace(start, stop, steps + 1)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def cylinder(radius: float, half_height: float) -> Surface:
    """A cylinder about z with filleted rims."""
    fillet = min(FILLET_M, 0.35 * radius, 0.6 * half_height)
    lower, upper = _arc(-np.pi / 2, 0.0, ARC_STEPS), _arc(0.0, np.pi / 2, ARC_STEPS)
    inner = np.array([radius - fillet, half_height - fillet])
    profile = np.concatenate(
        [
            [[0.0, -half_height]],
            inner * [1, -1] + fillet * lower,
            inner + fillet * upper,
            [[0.0, half_height]],
        ]
    )
    return revolve(profile, np.concatenate([[[0.0, -1.0]], lower, upper, [[0.0, 1.0]]]))


def capsule(radius: float, half_height: float) -> Surface:
    """A capsule about z: a cylinder of this half height between two half spheres."""
    lower, upper = _arc(-np.pi / 2, 0.0, SEGMENTS // 8), _arc(0.0, np.pi / 2, SEGMENTS // 8)
    profile = np.concatenate(
        [radius * lower - [0.0, half_height], radius * upper + [0.0, half_height]]
    )
    return revolve(profile, np.concatenate([lower, upper]))


def ellipsoid(radii: npt.ArrayLike) -> Surface:
    """An ellipsoid with these half axes (3,) [m]; a sphere where they are equal."""
    unit = _arc(-np.pi / 2, np.pi / 2, SEGMENTS // 2)
    ball, scale = revolve(unit, unit), np.asarray(radii, dtype=np.float64)
    normals = ball.normals / scale
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Surface(
        (ball.vertices * scale).astype(np.float32), normals.astype(np.float32), ball.faces
    )


def box(half_sizes: npt.ArrayLike, fillet: float = FILLET_M) -> Surface:
    """A box with rounded edges.

    Each face is a 6 × 6 grid on the sharp box; a point beyond the inner box (shrunk by the fillet)
    is pulled onto the sphere of that radius round the nearest point of the inner box.
    """
    half = np.asarray(half_sizes, dtype=np.float64)
    fillet = min(fillet, 0.45 * float(half.min()))
    inner = half - fillet
    steps = fillet * np.tan(np.linspace(0.0, np.pi / 4, 3))
    surfaces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (-1.0, 1.0):
            ticks = [np.concatenate([-(inner[k] + steps)[::-1], inner[k] + steps]) for k in (u, v)]
            # columns × rows must point outward: swap them on the negative side
            columns, rows = (u, v) if side > 0 else (v, u)
            along = {u: ticks[0], v: ticks[1]}
            grid = np.empty((6, 6, 3))
            grid[..., axis] = side * half[axis]
            grid[..., columns] = along[columns][None, :]
            grid[..., rows] = along[rows][:, None]
            points = grid.reshape(-1, 3)
            core = np.clip(points, -inner, inner)
            normals = points - core
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            surfaces.append(
                Surface(
                    (core + fillet * normals).astype(np.float32),
                    normals.astype(np.float32),
                    _grid_faces(6, 6),
                )
            )
    return merge(surfaces)


def primitive(kind: int, size: npt.NDArray[np.float64]) -> Surface | None:
    """The mesh of one MuJoCo primitive in its own frame, or None for planes and height fields."""
    match kind:
        case mujoco.mjtGeom.mjGEOM_BOX:
            return box(size)
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return cylinder(float(size[0]), float(size[1]))
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            return capsule(float(size[0]), float(size[1]))
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return ellipsoid(np.full(3, size[0]))
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            return ellipsoid(size)
        case _:
            return None
