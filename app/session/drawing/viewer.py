# pyright: reportAttributeAccessIssue=false
"""The view as a whole: draws the scene once, then one StepRecord after another."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
import viser

from app.core import value_slice
from app.core.settings import AssistanceSettings
from app.core.types import Goals
from app.recording.schema import StepRecord
from app.robot.model import build_model
from app.robot.scene import Scene
from app.session.drawing import palette
from app.session.drawing.camera import Cameras
from app.session.drawing.ghosts import GhostNodes
from app.session.drawing.hand import HandNodes
from app.session.drawing.labels import LabelNodes
from app.session.drawing.layers import Layers
from app.session.drawing.objects import ObjectNodes
from app.session.drawing.outbox import Outbox
from app.session.drawing.path import PathNodes
from app.session.drawing.robot import RobotNodes
from app.session.drawing.slice_layer import SliceLayer, SliceRequest, ValueSlice
from app.session.drawing.slice_plane import Bounds
from app.session.drawing.stage import Detail, Stage
from app.session.drawing.subject import TABLE, Subject, subject_of
from app.session.drawing.target import TargetNode

PROBE_CYCLE = 1000


class Viewer:
    """Draws a scene and the state of a trial into a viser server.

    It knows nothing of loops, clocks or simulations: a live worker and a replay feed it alike, from
    one thread. What has not changed is not sent.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        scene: Scene | Subject,
        theme: str = "dark",
        *,
        detail: Detail = "full",
        labels: bool = False,
        value_slice: ValueSlice = value_slice,
    ) -> None:
        """Draw everything that is there before the first record.

        Args:
            server: Where to draw.
            scene: A scene, or a model already sorted by `subject_of` (any robot).
            theme: "dark" or "light".
            detail: "plain" leaves out shadows, environment map and floor, which a browser without a
                graphics card spends most of its time on.
            labels: Draw probabilities into the scene as viser's labels, for a page without our own
                tags, such as a shared HTML file.
            value_slice: Computes the slice; `app.core.value_slice` but in tests.

        Raises:
            ThemeError: If there is no such theme.
        """
        chosen = palette.theme(theme)
        if isinstance(scene, Scene):
            subject = subject_of(build_model(scene), scene.object_names)
        else:
            subject = scene
        self._server, self._subject = server, subject
        self._layers = Layers()
        self._outbox = Outbox()
        self._theme = chosen
        self._last: tuple[StepRecord, Goals | None, AssistanceSettings | None] | None = None
        with server.atomic():
            self._cameras = Cameras(server)
            self._stage = Stage(server, subject, chosen, detail)
            self._robot = RobotNodes(server, subject, chosen, self._outbox)
            self._objects = ObjectNodes(server, subject, self._outbox)
            self._hand = HandNodes(server, chosen, self._outbox)
            self._ghosts = GhostNodes(server, subject, chosen, self._outbox)
            self._target = TargetNode(server, subject, chosen, self._outbox)
            self._path = PathNodes(server, chosen)
            self._labels = LabelNodes(server, subject.object_names) if labels else None
            self._probe = server.scene.add_frame("/probe", show_axes=False)
        self._slice = SliceLayer(server, chosen, value_slice, _table_bounds(subject))
        self._slice.set_visible(self._layers.slice)
        server.flush()

    def update(
        self,
        record: StepRecord,
        goals: Goals | None = None,
        settings: AssistanceSettings | None = None,
    ) -> None:
        """Draw one tick.

        Args:
            record: The tick.
            goals: Goals with their targets in the world; None: no ghosts and no slice.
            settings: The assistance whose V the slice shows; None: no slice.
        """
        if self._last is not None and record.step < self._last[0].step:
            self._path.clear()  # a new trial, or a replay that went back
        self._last = (record, goals, settings)
        sent = self._outbox.count
        with self._server.atomic():
            extended = self._draw(record, goals)
        if extended or self._outbox.count != sent:
            # After the block: viser sends nothing while it is open, and without this waits for up
            # to a sixtieth of a second.
            self._server.flush()
        self._request_slice()

    def hide_objects(self) -> None:
        """Draw no objects, for practice at an empty table."""
        with self._server.atomic():
            self._objects.hide()
        self._server.flush()

    def set_layers(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Change some of the layers.

        Args:
            changes: New values by name, see `Layers`.

        Returns:
            All layers by name, as they are now.

        Raises:
            LayersError: If a name is unknown or a value invalid; nothing is changed then.
        """
        self._layers = self._layers.changed(changes, self._subject.object_names)
        with self._server.atomic():
            self._objects.set_tags_visible(self._layers.tags)
            self._path.set_visible(self._layers.path)
            self._slice.set_visible(self._layers.slice)
            if self._last is not None:
                self._draw(self._last[0], self._last[1])
        self._server.flush()
        self._request_slice()
        return self._layers.to_dict()

    def set_theme(self, theme: str) -> None:
        """Switch between "dark" and "light".

        Raises:
            ThemeError: If there is no such theme.
        """
        chosen = palette.theme(theme)
        if chosen is self._theme:
            return
        self._theme = chosen
        with self._server.atomic():
            for part in (
                self._stage,
                self._robot,
                self._hand,
                self._ghosts,
                self._target,
                self._path,
                self._slice,
            ):
                part.set_theme(chosen)
        self._server.flush()

    def set_camera(self, preset: str) -> None:
        """Move every browser's camera to "operator", "side", "top", or with "reset" back to it.

        Raises:
            CameraError: If there is no such preset.
        """
        self._cameras.set(preset)

    def set_target(self, goal: str | None) -> None:
        """Put the ring round the object that the person is asked to grasp, or remove it."""
        with self._server.atomic():
            self._target.set(goal)
        self._server.flush()

    def clear_path(self) -> None:
        """Forget where the hand has been: a new trial."""
        self._path.clear()
        self._server.flush()

    def close(self) -> None:
        """End the view's own thread and let go of the cameras; nodes and server stay."""
        self._cameras.close()
        self._slice.close()

    @property
    def layers(self) -> dict[str, Any]:
        """All layers by name."""
        return self._layers.to_dict()

    @property
    def theme(self) -> str:
        """Name of the theme."""
        return self._theme.name

    @property
    def camera(self) -> str:
        """Name of the camera preset that was chosen last."""
        return self._cameras.preset

    @property
    def value_range(self) -> tuple[float, float] | None:
        """Lowest and highest value of the slice shown [nat]; None while there is none."""
        return self._slice.value_range

    @property
    def messages_sent(self) -> int:
        """Property changes sent by `update` since the start."""
        return self._outbox.count

    def _draw(self, record: StepRecord, goals: Goals | None) -> bool:
        """Send what this record changes; returns whether the path grew."""
        layers = self._layers
        self._robot.update(record.joint_positions_rad, record.finger_positions_m)
        self._objects.update(record.object_poses)
        self._target.update(self._objects.positions)
        self._hand.update(
            record.hand_position_m,
            record.direct_twist if layers.user else None,
            record.assistance_twist if layers.assist and record.enabled else None,
        )
        self._ghosts.update(goals if layers.ghosts else None, record.belief, record.best_targets)
        if self._labels is not None:
            self._labels.update(record.belief if layers.tags else None)
        # y keeps two large sequence numbers apart under viser's relative tolerance
        self._outbox.put(
            self._probe,
            "position",
            (float(record.sequence), float(record.sequence % PROBE_CYCLE), 0.0),
        )
        return self._path.update(record.hand_position_m, record.time_s)

    def _request_slice(self) -> None:
        if self._last is None or not self._layers.slice:
            return
        record, goals, settings = self._last
        if goals is None or settings is None:
            return
        self._slice.request(
            SliceRequest(
                settings,
                goals,
                tuple(record.belief),
                np.asarray(record.hand_position_m),
                np.asarray(record.hand_quaternion),
                self._layers.slice_of,
                self._layers.slice_plane,
            )
        )


def _table_bounds(subject: Subject) -> Bounds:
    """The top of the model's table, or the default one where it has none."""
    model = subject.model
    table = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, TABLE)
    if table < 0:
        return Bounds()
    x, y, _ = model.geom_pos[table].tolist()
    half_x, half_y, _ = model.geom_size[table].tolist()
    return Bounds((x - half_x, x + half_x), (y - half_y, y + half_y))
