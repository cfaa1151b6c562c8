"""Camera presets: what the design says at its shapes, everything in sight at others."""

import numpy as np
import pytest
import viser

from app.session.drawing import Viewer
from app.session.drawing.camera import OPERATOR_BY_ASPECT, TOP, CameraError, view_for


@pytest.mark.parametrize(("aspect", "view"), OPERATOR_BY_ASPECT)
def test_the_operator_stands_where_the_design_says(aspect: float, view: object) -> None:
    """The operator stands where the design says."""
    assert view_for("operator", aspect) == view


def test_between_two_shapes_the_camera_lies_between() -> None:
    """Between two shapes the camera lies between."""
    wide, middle, narrow = (view_for("operator", a).position[1] for a in (1.6, 1.45, 4 / 3))
    assert narrow < middle < wide
    assert view_for("operator", 3.0) == view_for("operator", 2.1)


@pytest.mark.parametrize("preset", ["operator", "side", "top"])
@pytest.mark.parametrize("aspect", [0.46, 0.75, 4 / 3, 1.6, 2.2])
def test_all_places_for_objects_are_in_sight(preset: str, aspect: float) -> None:
    """All places for objects are in sight."""
    view = view_for(preset, aspect)
    eye, target = np.asarray(view.position), np.asarray(view.look_at)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    if np.linalg.norm(right) < 1e-9:
        right = np.array([0.0, -1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    half = np.tan(np.radians(view.fov_degrees) / 2)
    for x, y in ((0.82, 0.22), (0.85, 0.0), (0.82, -0.22), (0.0, 0.0)):
        ray = np.array([x, y, 0.1]) - eye
        depth = ray @ forward
        assert abs(ray @ up) < depth * half
        assert abs(ray @ right) < depth * half * aspect


def test_the_top_view_does_not_roll() -> None:
    """The top view does not roll."""
    assert TOP.position[1] == TOP.look_at[1]


def test_presets_and_reset(server: viser.ViserServer, viewer: Viewer) -> None:
    """Presets and reset."""
    viewer.set_camera("side")
    viewer.set_camera("reset")
    assert viewer.camera == "side"
    assert server.initial_camera.position == pytest.approx(view_for("side", 1.6).position)
    with pytest.raises(CameraError, match="operator, side, top, reset"):
        viewer.set_camera("ceiling")
    assert viewer.camera == "side"
