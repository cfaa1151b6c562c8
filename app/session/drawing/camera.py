"""Where the operator looks from: presets, fitted to the panel's shape."""

import threading
from dataclasses import dataclass
from typing import Literal

import numpy as np
import viser

from app.errors import AppError

Preset = Literal["operator", "side", "top"]
PRESETS: tuple[Preset, ...] = ("operator", "side", "top")
RESET = "reset"
"""Back to the preset that was chosen last."""


class CameraError(AppError):
    """A camera preset that does not exist."""


@dataclass(frozen=True, slots=True)
class View:
    """One camera: where it stands and looks in the world [m], and its vertical angle [degrees]."""

    position: tuple[float, float, float]
    look_at: tuple[float, float, float]
    fov_degrees: float


OPERATOR_BY_ASPECT: tuple[tuple[float, View], ...] = (
    (0.75, View((-0.42, -1.42, 1.18), (0.47, -0.04, 0.05), 40.0)),
    (4 / 3, View((-0.42, -1.30, 1.10), (0.395, -0.02, 0.085), 38.0)),
    (1.6, View((-0.36, -1.14, 0.98), (0.45, -0.03, 0.09), 38.0)),
    (2.1, View((-0.36, -1.14, 0.98), (0.45, -0.03, 0.18), 38.0)),
)
"""The operator stands to the robot's right: from behind, the arm hides the objects. Panels narrower
than the first of these shapes, such as an upright phone, see the same from further away; low ones,
such as a phone held sideways, look up a little, so that the elbow stays below the row of chips."""
SIDE = View((0.45, -1.75, 0.5), (0.42, 0.0, 0.16), 36.0)
TOP = View((0.465, 0.0, 2.1), (0.47, 0.0, 0.0), 36.0)
"""y is equal in both points: otherwise the picture rolls."""
INITIAL_ASPECT = 1.6
SAME_SHAPE = 0.02
"""Aspects that differ by less, as a logarithm, are framed alike."""
SAME_PLACE_M = 0.01
"""A camera this near to where it was put has not been moved by hand [m]."""
FITTED_ASPECT = 4 / 3
"""Side and top are framed for this width to height; narrower panels see them from further away."""


def view_for(preset: str, aspect: float) -> View:
    """The camera of a preset for a panel of this width divided by height.

    Raises:
        CameraError: If there is no such preset.
    """
    if preset == "operator":
        aspects = [a for a, _ in OPERATOR_BY_ASPECT]

        def between(values: list[float]) -> float:
            return float(np.interp(aspect, aspects, values))

        views = [view for _, view in OPERATOR_BY_ASPECT]
        x, y, z = (between([v.position[i] for v in views]) for i in range(3))
        at_x, at_y, at_z = (between([v.look_at[i] for v in views]) for i in range(3))
        view = View((x, y, z), (at_x, at_y, at_z), between([v.fov_degrees for v in views]))
        return _from_further(view, aspects[0] / aspect)
    if preset not in PRESETS:
        raise CameraError(
            f"camera {preset!r} does not exist; valid are: {', '.join((*PRESETS, RESET))}"
        )
    return _from_further(SIDE if preset == "side" else TOP, FITTED_ASPECT / aspect)


def _from_further(view: View, times: float) -> View:
    """The same view from so many times as far away, never from nearer."""
    if times <= 1.0:
        return view
    eye, target = np.asarray(view.position), np.asarray(view.look_at)
    x, y, z = (target + times * (eye - target)).tolist()
    return View((x, y, z), view.look_at, view.fov_degrees)


class Cameras:
    """Puts the cameras of all connected browsers where a preset says, and of those to come.

    A panel that changes its shape (a phone is turned, a second view joins) is framed anew, unless
    its camera was moved by hand meanwhile.
    """

    def __init__(self, server: viser.ViserServer, preset: Preset = "operator"):
        self._server = server
        self.preset: str = preset
        self._closed = False
        self._framed: dict[int, tuple[float, View]] = {}
        """Client's id → aspect and view that it was given last."""
        self._placing = threading.Lock()
        server.on_client_connect(self._arrived)
        server.on_client_disconnect(self._left)
        self._set_initial()

    def set(self, preset: str) -> None:
        """Move every browser's camera to a preset, or with "reset" back to the chosen one.

        Raises:
            CameraError: If there is no such preset.
        """
        wanted = self.preset if preset == RESET else preset
        view_for(wanted, 1.0)
        self.preset = wanted
        self._set_initial()
        with self._placing:
            for client in self._server.get_clients().values():
                self._place(client)

    def close(self) -> None:
        """Leave browsers to another view from now on; viser keeps its callbacks."""
        self._closed = True

    def _set_initial(self) -> None:
        """A first view for the moment before a browser has told its shape."""
        view, camera = view_for(self.preset, INITIAL_ASPECT), self._server.initial_camera
        camera.position, camera.look_at = view.position, view.look_at
        camera.fov = float(np.radians(view.fov_degrees))

    def _arrived(self, client: viser.ClientHandle) -> None:
        if self._closed:
            return

        @client.camera.on_update
        def _(_: viser.CameraHandle) -> None:
            with self._placing:
                if self._is_astray(client):
                    self._place(client)

        with self._placing:
            self._place(client)

    def _left(self, client: viser.ClientHandle) -> None:
        self._framed.pop(client.client_id, None)

    def _is_astray(self, client: viser.ClientHandle) -> bool:
        """Whether the camera is not where this panel's shape wants it, and nobody moved it there.

        A browser may take up the first view after it was given one of its own.
        """
        framed = self._framed.get(client.client_id)
        if self._closed or framed is None:
            return False
        aspect, view = framed
        if _is_at(client, view):
            return bool(abs(np.log(_aspect_of(client) / aspect)) > SAME_SHAPE)
        return _is_at(client, view_for(self.preset, INITIAL_ASPECT))

    def _place(self, client: viser.ClientHandle) -> None:
        camera, aspect = client.camera, _aspect_of(client)
        view = view_for(self.preset, aspect)
        self._framed[client.client_id] = (aspect, view)
        with client.atomic():
            camera.fov = float(np.radians(view.fov_degrees))
            camera.position = view.position
            camera.look_at = view.look_at
            camera.up_direction = (0.0, 0.0, 1.0)
        client.flush()


def _aspect_of(client: viser.ClientHandle) -> float:
    """Width divided by height; a panel that is hidden has neither."""
    width, height = client.camera.image_width, client.camera.image_height
    return width / height if width and height else INITIAL_ASPECT


def _is_at(client: viser.ClientHandle, view: View) -> bool:
    return bool(np.allclose(client.camera.position, view.position, atol=SAME_PLACE_M))
