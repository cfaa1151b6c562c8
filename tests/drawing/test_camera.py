"""Camera presets: what the design says at its shapes, everything in sight at others."""

import time
from collections.abc import Callable

import msgspec
import numpy as np
import pytest
import viser
from websockets.sync.client import connect
from websockets.typing import Subprotocol

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


def test_a_panel_of_another_shape_is_framed_anew_unless_it_was_moved(
    server: viser.ViserServer, viewer: Viewer
) -> None:
    """A second view halves it, a phone is turned; a camera moved by hand stays where it is."""
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    url = f"ws://127.0.0.1:{server.get_port()}"
    with connect(url, subprotocols=[protocol], compression=None, max_size=None) as browser:

        def tell(position: tuple[float, float, float], width: int) -> None:
            message = {
                "type": "ViewerCameraMessage",
                "wxyz": (1.0, 0.0, 0.0, 0.0),
                "position": position,
                "fov": 0.66,
                "near": 0.01,
                "far": 100.0,
                "image_height": 500,
                "image_width": width,
                "look_at": (0.4, 0.0, 0.1),
                "up_direction": (0.0, 0.0, 1.0),
            }
            browser.send(msgspec.msgpack.encode(message))

        def stands_at(position: tuple[float, float, float]) -> Callable[[], bool]:
            return lambda: any(
                np.allclose(client.camera.position, position)
                for client in server.get_clients().values()
            )

        wide, narrow = (view_for("operator", aspect).position for aspect in (1.6, 0.8))
        tell((3.0, 3.0, 3.0), 800)
        wait_until(stands_at(wide))
        tell(wide, 400)
        wait_until(stands_at(narrow))
        tell(wide, 400)  # viser's first view, taken up late
        wait_until(stands_at(narrow))
        tell((0.0, -2.0, 1.0), 800)
        wait_until(stands_at((0.0, -2.0, 1.0)))
        tell((0.0, -2.0, 1.1), 400)
        wait_until(stands_at((0.0, -2.0, 1.1)))
        time.sleep(0.2)
        assert stands_at((0.0, -2.0, 1.1))()


def wait_until(condition: Callable[[], bool]) -> None:
    """Wait until it holds; patience only ends a test that would hang."""
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)
