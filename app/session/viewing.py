"""The 3-D view of a session in its own thread: a browser that stalls never delays the loop."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import viser

from app.errors import AppError
from app.robot.scene import Scene
from app.session.drawing import Viewer
from app.session.frame import Frame
from app.session.readers import LatestReader

Done = Callable[[str | None], None]
"""Told how a request went: None, or what was wrong with it."""

HIDDEN_LAYERS: dict[str, dict[str, Any]] = {
    "belief": {"ghosts": False, "tags": False, "slice": False},
    "assistance": {"assist": False},
}
"""Layers that would show what a study hides; they stay off."""


@dataclass(frozen=True, slots=True)
class ViewState:
    """What the page is told of the view; replaced as a whole."""

    layers: Mapping[str, Any]
    camera: str
    value_range: tuple[float, float] | None


class Viewing:
    """Owns the viewer and the thread that alone touches it."""

    def __init__(
        self,
        server: viser.ViserServer,
        scene: Scene,
        *,
        theme: str,
        layers: Mapping[str, Any],
        camera: str,
        hide: tuple[str, ...],
        rate_hz: float,
        show_objects: bool = True,
        on_error: Callable[[Exception], None],
    ) -> None:
        """Draw a scene.

        Args:
            server: Where to draw.
            scene: What to draw first.
            theme: "dark" or "light".
            layers: Changes to the layers that are shown first.
            camera: First camera preset.
            hide: What a study hides.
            rate_hz: Most updates a second.
            show_objects: Whether objects and the target's ring are drawn.
            on_error: Told about a failed update, in the view's thread.

        Raises:
            LayersError: If a layer does not exist.
            CameraError: If the preset does not exist.
        """
        self._server = server
        self._locked = {k: v for part in hide for k, v in HIDDEN_LAYERS.get(part, {}).items()}
        self._show_objects = show_objects
        self._viewer = Viewer(server, scene, theme)
        if not show_objects:
            self._viewer.hide_objects()
        self._viewer.set_layers({**layers, **self._locked})
        self._viewer.set_camera(camera)
        self._trial: object = None
        self.state = self._look()
        self._reader: LatestReader[Frame] = LatestReader("viewer", self._draw, rate_hz, on_error)

    @property
    def updates(self) -> int:
        """Updates drawn so far."""
        return self._reader.calls

    def offer(self, frame: Frame) -> None:
        """Let the newest tick be drawn when its time has come."""
        self._reader.offer(frame)

    def show_scene(self, scene: Scene) -> None:
        """Draw another scene from now on, with theme, layers and camera as they are."""

        def replace() -> None:
            old = self._viewer
            theme, layers, camera = old.theme, old.layers, old.camera
            old.close()
            self._server.scene.reset()
            self._viewer = Viewer(self._server, scene, theme)
            if layers["slice_of"] not in ("belief", "soft-min"):
                layers["slice_of"] = "belief"  # the old scene's goal
            self._viewer.set_layers(layers)
            self._viewer.set_camera(camera)
            self._trial = None

        self._reader.run(replace)

    def request(self, name: str, args: Mapping[str, Any], done: Done) -> None:
        """Carry out a command of the view: layers, camera or theme.

        Args:
            name: Of the command.
            args: Its checked fields.
            done: Called in the view's thread.
        """

        def act() -> None:
            try:
                self._act(name, args)
            except AppError as error:
                done(str(error))
            else:
                done(None)

        self._reader.run(act)

    def close(self) -> None:
        """Stop drawing; a call that hangs is left behind with its thread."""
        if self._reader.close():
            self._viewer.close()

    def _act(self, name: str, args: Mapping[str, Any]) -> None:
        if name == "layers":
            for layer, value in args["changes"].items():
                if layer in self._locked and value != self._locked[layer]:
                    raise AppError(f"layer {layer} is {value!r}; valid in this study: off")
            self._viewer.set_layers(args["changes"])
        elif name == "camera":
            self._viewer.set_camera(args["preset"])
        else:
            self._viewer.set_theme(args["theme"])
        self.state = self._look()

    def _draw(self, frame: Frame) -> None:
        trial = (frame.view.number, frame.view.target)
        if trial != self._trial:
            self._trial = trial
            self._viewer.clear_path()
            self._viewer.set_target(frame.view.target if self._show_objects else None)
        self._viewer.update(frame.record, frame.goals, frame.settings)
        self.state = self._look()

    def _look(self) -> ViewState:
        viewer = self._viewer
        return ViewState(viewer.layers, viewer.camera, viewer.value_range)
