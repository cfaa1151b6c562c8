# pyright: reportAttributeAccessIssue=false
"""From a scene to a compiled MuJoCo model: the arm, the table, one free body per object."""

import hashlib

import mujoco
import numpy as np

from app.robot.arm import ARM_FILE
from app.robot.objects import HUES, AnyObject, Block, Box, Canteen, Glass
from app.robot.scene import Scene, Table

PHYSICS_DT = 0.002  # [s]
TABLE_THICKNESS = 0.04  # [m]
_CYLINDER = mujoco.mjtGeom.mjGEOM_CYLINDER
_SURFACE = {
    "contype": 2,
    "conaffinity": 3,
    "condim": 4,
    "friction": [0.6, 0.005, 0.0001],
    "solref": [0.005, 1.0],
    "solimp": [0.95, 0.99, 0.001, 0.5, 2.0],
    "group": 2,
}
"""Objects and table: stiff (MuJoCo's default contacts creep 6–14 mm) and moderately slippery."""
_DRAWN = {"contype": 0, "conaffinity": 0, "group": 2, "mass": 0.0}
_CAP = (0.12, 0.12, 0.13, 1.0)
_BAND = (0.85, 0.85, 0.82, 1.0)
_WATER = (0.24, 0.61, 0.86, 0.82)


def build_model(scene: Scene) -> mujoco.MjModel:
    """Compile arm, table and objects.

    Bodies of objects have the object's name, their geoms `<object>/<part>`; the free joint is the
    object's name too. Objects' poses in the compiled model are those of the default layout.
    """
    spec = mujoco.MjSpec.from_file(str(ARM_FILE))
    spec.modelname = f"hindsight_{scene.name}"
    spec.option.timestep = PHYSICS_DT
    _add_table(spec, scene.table)
    for item, place in zip(scene.objects, scene.default_layout, strict=True):
        spot = scene.places[place]
        yaw = np.radians(spot.yaw_degrees)
        body = spec.worldbody.add_body(
            name=f"object/{item.name}",
            pos=[spot.x_m, spot.y_m, 0.0],
            quat=[np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)],
        )
        body.add_freejoint(name=f"object/{item.name}")
        _add_geoms(body, item)
    return spec.compile()


def model_hash(model: mujoco.MjModel) -> str:
    """SHA-256 of the compiled model's bytes; equal hashes promise bit-identical re-simulation."""
    buffer = np.zeros(mujoco.mj_sizeModel(model), dtype=np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return hashlib.sha256(buffer.tobytes()).hexdigest()


def _add_table(spec: mujoco.MjSpec, table: Table) -> None:
    half_x = 0.5 * (table.x_max_m - table.x_min_m)
    half_y = 0.5 * (table.y_max_m - table.y_min_m)
    spec.worldbody.add_geom(
        name="table",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[half_x, half_y, 0.5 * TABLE_THICKNESS],
        pos=[table.x_min_m + half_x, table.y_min_m + half_y, -0.5 * TABLE_THICKNESS],
        rgba=[0.165, 0.192, 0.220, 1.0],
        **_SURFACE,
    )


def _add_geoms(body: mujoco.MjsBody, item: AnyObject) -> None:
    """Collision geoms carry the mass; drawn ones (bands, water) carry none."""
    colour = [*HUES[item.colour], 1.0]
    if isinstance(item, Block | Box):
        half = [0.5 * side for side in item.size_m]
        body.add_geom(
            name=f"{item.name}/body",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=half,
            pos=[0.0, 0.0, half[2]],
            rgba=colour,
            mass=item.mass_kg,
            **_SURFACE,
        )
    elif isinstance(item, Canteen):
        _add_canteen(body, item, colour)
    elif isinstance(item, Glass):
        _upright(
            body,
            f"{item.name}/body",
            item.radius_m,
            0.0,
            item.height_m,
            item.mass_kg,
            [*colour[:3], 0.42],
        )
        if item.water_level > 0.0:
            _drawn(
                body,
                f"{item.name}/water",
                item.radius_m - 0.003,
                0.008,
                0.008 + item.water_level * (item.height_m - 0.008),
                _WATER,
            )
    else:
        _upright(body, f"{item.name}/body", item.radius_m, 0.0, item.height_m, item.mass_kg, colour)


def _add_canteen(body: mujoco.MjsBody, item: Canteen, colour: list[float]) -> None:
    """88 % of the mass in the body, 6 % each in shoulder and neck."""
    top = item.body_height_m
    shoulder = 0.62 * item.radius_m
    _upright(body, f"{item.name}/body", item.radius_m, 0.0, top, 0.88 * item.mass_kg, colour)
    body.add_geom(
        name=f"{item.name}/shoulder",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        size=[max(shoulder, item.neck_radius_m), 0.0, 0.0],
        fromto=[0.0, 0.0, top - 0.002, 0.0, 0.0, top + 0.010],
        rgba=colour,
        mass=0.06 * item.mass_kg,
        **_SURFACE,
    )
    _upright(
        body,
        f"{item.name}/neck",
        item.neck_radius_m,
        top + 0.5 * item.neck_height_m,
        top + item.neck_height_m,
        0.06 * item.mass_kg,
        list(_CAP),
    )
    _drawn(body, f"{item.name}/band", item.radius_m + 0.0004, 0.33 * top, 0.40 * top, _BAND)


def _upright(
    body: mujoco.MjsBody,
    name: str,
    radius: float,
    low: float,
    high: float,
    mass: float,
    rgba: list[float],
) -> None:
    body.add_geom(
        name=name,
        type=_CYLINDER,
        size=[radius, 0.5 * (high - low), 0.0],
        pos=[0.0, 0.0, 0.5 * (low + high)],
        rgba=rgba,
        mass=mass,
        **_SURFACE,
    )


def _drawn(
    body: mujoco.MjsBody,
    name: str,
    radius: float,
    low: float,
    high: float,
    rgba: tuple[float, ...],
) -> None:
    body.add_geom(
        name=name,
        type=_CYLINDER,
        size=[radius, 0.5 * (high - low), 0.0],
        pos=[0.0, 0.0, 0.5 * (low + high)],
        rgba=list(rgba),
        **_DRAWN,
    )
