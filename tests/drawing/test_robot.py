# pyright: reportAttributeAccessIssue=false
"""The robot and the objects stand where MuJoCo puts them, whatever they are made of."""

import json
from collections.abc import Callable
from typing import Any

import msgspec
import mujoco
import numpy as np
import pytest
import trimesh
import viser

from app.recording.schema import StepRecord
from app.robot.model import build_model
from app.robot.scene import Scene
from app.session.drawing import Viewer, subject_of
from app.session.drawing.glb import Material, write_glb
from app.session.drawing.meshes import crease_normals
from app.session.drawing.palette import linear
from app.session.drawing.shapes import Surface, box, capsule, cylinder, ellipsoid, revolve
from app.session.drawing.subject import SubjectError

Find = Callable[[str], Any]

MESH_ROBOT = """
<mujoco>
  <asset>
    <mesh name="wedge" vertex="0 0 0  .1 0 0  0 .1 0  0 0 .2"/>
    <texture name="stripes" type="2d" builtin="checker" rgb1="1 0 0" rgb2="0 0 1"
             width="8" height="8"/>
    <mesh name="sheet" vertex="0 0 0  .1 0 0  0 .1 0  0 0 .1" texcoord="0 0  1 0  0 1  1 1"
          face="0 2 1  0 1 3  1 2 3  0 3 2"/>
    <material name="printed" texture="stripes"/>
  </asset>
  <worldbody>
    <body name="stem">
      <geom type="mesh" mesh="wedge" rgba=".2 .4 .6 1"/>
      <body name="tip" pos="0 0 .2">
        <joint name="turn" type="hinge" axis="0 1 0"/>
        <geom type="mesh" mesh="sheet" material="printed"/>
        <geom type="sphere" size=".02" group="3"/>
        <site name="ee" pos="0 0 .1"/>
        <body name="jaw" pos="0 .02 .1">
          <joint name="close" type="slide" axis="0 1 0"/>
          <geom type="capsule" size=".01 .02"/>
          <geom type="ellipsoid" size=".01 .02 .03"/>
        </body>
      </body>
    </body>
    <body name="cube" pos=".4 0 .05"><freejoint/><geom type="box" size=".03 .03 .05"/></body>
  </worldbody>
</mujoco>
"""


def world_pose(node: Find, name: str) -> tuple[np.ndarray, np.ndarray]:
    """A node's pose in the world through all its parents, as viser's client computes it."""
    position, quaternion = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    parts = name.strip("/").split("/")
    for depth in range(1, len(parts) + 1):
        handle = node("/" + "/".join(parts[:depth]))
        turned, product = np.empty(3), np.empty(4)
        mujoco.mju_rotVecQuat(turned, handle.position, quaternion)
        mujoco.mju_mulQuat(product, quaternion, handle.wxyz)
        position, quaternion = position + turned, product
    return position, quaternion


def test_every_link_is_where_mujoco_has_it(
    viewer: Viewer, scene: Scene, records: list[StepRecord], node: Find
) -> None:
    """Every link is where MuJoCo has it."""
    model = build_model(scene)
    subject, data = subject_of(model, scene.object_names), mujoco.MjData(model)
    for record in records[::4]:
        viewer.update(msgspec.structs.replace(record, finger_positions_m=[0.02, 0.02]))
        data.qpos[subject.joint_addresses] = record.joint_positions_rad
        data.qpos[subject.finger_addresses] = 0.02
        mujoco.mj_kinematics(model, data)
        path = "/hindsight/arm"
        for body in subject.robot_bodies:
            name = model.body(body).name
            full = f"{path}/{name}"
            position, quaternion = world_pose(node, full)
            assert position == pytest.approx(data.xpos[body], abs=2e-4)
            assert abs(quaternion @ data.xquat[body]) == pytest.approx(1.0, abs=2e-4)
            if name != "finger_left":  # the other finger is its sister, not its child
                path = full


def test_objects_are_where_the_record_says(
    viewer: Viewer, records: list[StepRecord], node: Find
) -> None:
    """Objects are where the record says."""
    poses = np.asarray(records[0].object_poses).reshape(-1, 7)
    poses[1] = [0.5, 0.1, 0.3, 0.6, 0.0, 0.8, 0.0]
    viewer.update(msgspec.structs.replace(records[0], object_poses=poses.ravel().tolist()))
    block = node("/hindsight/object/block")
    assert block.position == pytest.approx(poses[1, :3], abs=1e-4)
    assert block.wxyz == pytest.approx(poses[1, 3:], abs=1e-4)


def test_glass_casts_no_shadow(viewer: Viewer, node: Find) -> None:
    """Glass casts no shadow."""
    assert not node("/hindsight/object/glass/clear").cast_shadow
    assert node("/hindsight/object/canteen/solid").cast_shadow


def materials_of(data: bytes) -> list[dict[str, Any]]:
    """The material table of a GLB file, read by its own header."""
    length = int(np.frombuffer(data, "<u4", 1, 12)[0])
    return json.loads(data[20 : 20 + length])["materials"]


def test_a_robot_of_meshes_draws(server: viser.ViserServer, node: Find, records: Any) -> None:
    """A robot of meshes draws."""
    model = mujoco.MjModel.from_xml_string(MESH_ROBOT)
    subject = subject_of(model)
    assert subject.object_names == ("cube",)
    assert (len(subject.joint_addresses), len(subject.finger_addresses)) == (1, 1)
    viewer = Viewer(server, subject)
    viewer.update(
        msgspec.structs.replace(
            records[0],
            joint_positions_rad=[0.3],
            finger_positions_m=[0.01],
            object_poses=[0.4, 0.0, 0.05, 1.0, 0.0, 0.0, 0.0],
            belief=[1.0],
            best_targets=[0],
        )
    )
    stem, tip = node("/hindsight/arm/stem/mesh").glb_data, node("/hindsight/arm/stem/tip/mesh")
    assert materials_of(stem)[0]["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(
        [*linear("#336699"), 1.0], abs=1e-6
    )
    look = materials_of(tip.glb_data)
    assert len(look) == 1  # the collision sphere of group 3 is not drawn
    assert "baseColorTexture" in look[0]["pbrMetallicRoughness"]
    jaw = node("/hindsight/arm/stem/tip/jaw").position
    assert jaw == pytest.approx([0.0, 0.03, 0.1], abs=1e-4)
    viewer.close()


def test_a_model_without_the_hand_is_refused() -> None:
    """A model without the hand is refused."""
    model = mujoco.MjModel.from_xml_string(MESH_ROBOT)
    with pytest.raises(SubjectError, match="no site 'palm'; it has: ee"):
        subject_of(model, hand_site="palm")
    with pytest.raises(SubjectError, match="no object 'cup'; free bodies are: cube"):
        subject_of(model, ("cup",))


@pytest.mark.parametrize(
    ("surface", "volume"),
    [
        (box([0.03, 0.02, 0.05]), 8 * 0.03 * 0.02 * 0.05),
        (cylinder(0.04, 0.06), np.pi * 0.04**2 * 0.12),
        (capsule(0.03, 0.05), np.pi * 0.03**2 * (0.1 + 4 / 3 * 0.03)),
        (ellipsoid([0.02, 0.03, 0.04]), 4 / 3 * np.pi * 0.02 * 0.03 * 0.04),
    ],
)
def test_shapes_are_closed_face_outward_and_keep_their_volume(
    surface: Surface, volume: float
) -> None:
    """Shapes are closed face outward and keep their volume."""
    a, b, c = (surface.vertices[surface.faces[:, i]].astype(float) for i in range(3))
    inside = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert inside == pytest.approx(volume, rel=0.03)  # fillets and facets take a little
    normals = np.cross(b - a, c - a)
    area = np.linalg.norm(normals, axis=1)
    real = area > 1e-12
    shading = surface.normals[surface.faces].mean(axis=1)[real]
    assert (np.einsum("ij,ij->i", normals[real] / area[real, None], shading) > 0.8).all()
    assert np.linalg.norm(surface.normals, axis=1) == pytest.approx(1.0, abs=1e-5)


def test_creases_split_and_curves_stay_smooth() -> None:
    """Creases split and curves stay smooth."""
    cube = trimesh.creation.box((0.2, 0.2, 0.2))
    sharp = crease_normals(np.asarray(cube.vertices), np.asarray(cube.faces, dtype=np.int64))
    assert sharp == pytest.approx(np.repeat(cube.face_normals[:, None], 3, axis=1))
    angle = np.linspace(-np.pi / 2, np.pi / 2, 17)
    unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ball = revolve(unit, unit, segments=32)
    corners = ball.vertices[ball.faces].astype(float)
    real = (
        np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        > 1e-9
    )
    smooth = crease_normals(ball.vertices.astype(float), ball.faces[real].astype(np.int64))
    assert (np.einsum("ijk,ijk->ij", smooth, corners[real]) > 0.98).all()


def test_glb_keeps_linear_colour_and_blends_what_is_translucent() -> None:
    """GLB keeps linear colour and blends what is translucent."""
    glass = Material((0.1, 0.2, 0.3), alpha=0.4, roughness=0.08)
    data = write_glb([(cylinder(0.03, 0.05), glass), (box([0.1, 0.1, 0.1]), Material((0, 0, 0)))])
    assert len(data) == int(np.frombuffer(data, "<u4", 1, 8)[0])
    first, second = materials_of(data)
    assert first["pbrMetallicRoughness"]["baseColorFactor"] == [0.1, 0.2, 0.3, 0.4]
    assert first["alphaMode"] == "BLEND" and "alphaMode" not in second
