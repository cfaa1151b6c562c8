"""One 3-D view of a review: a viser server, and the trial that is drawn in it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np
import viser

from app.core import CoreError, counterfactuals, initial_state
from app.core.types import Array
from app.review.errors import ReviewError
from app.review.opening import open_trial
from app.review.posing import ArmPoser
from app.review.replay import Replay
from app.session.drawing import Viewer
from app.session.drawing.palette import rgb, theme
from app.session.drawing.stage import Detail

PATH_NODES = {"log": "/hindsight/review/path", "what-if": "/hindsight/review/what-if"}
"""Paths of the hand: as it was, and as it would have been."""
MAX_PATH_POINTS = 800


class ReviewView:
    """Owns what is drawn; used by one thread."""

    def __init__(self, server: viser.ViserServer, theme_name: str, layers: Mapping[str, Any]):
        """Take a server that draws nothing yet.

        Args:
            server: Where to draw.
            theme_name: "dark" or "light".
            layers: Changes to the layers shown first; `path` shows the whole trial's.
        """
        self.server = server
        self.replay: Replay | None = None
        self.trial_id = ""
        """By which the page knows the trial."""
        self.step = -1
        """The step that is drawn; −1: none."""
        self.moment: dict[str, list[float]] = {}
        """What each method would ask for at that step: method → twist (6,)."""
        self._theme = theme_name
        self._layers = dict(layers)
        self._camera = "operator"
        self._detail: Detail = "full"
        self._viewer: Viewer | None = None
        self._scene_json = ""
        self._paths: dict[str, Array] = {}
        self._poser = ArmPoser()

    def open(self, path: str) -> None:
        """Show a trial from its first step on.

        Raises:
            AppError: If its log cannot be used; what was shown before stays.
        """
        replay = Replay(open_trial(Path(path)))
        if self._viewer is None or replay.header.scene_json != self._scene_json:
            self._rebuild(replay)
        self._begin(replay, 0)

    def draw(self, step: int) -> None:
        """Show one step of the trial; nothing while none is open."""
        replay, viewer = self.replay, self._viewer
        if replay is None or viewer is None:
            return
        step = replay.clamp(step)
        record = self._poser.record(replay, step)
        try:
            settings = replay.settings(step)
            self.moment = methods_at(replay, step)
        except CoreError:  # settings of a newer program: the picture does without their slice
            settings, self.moment = None, {}
        viewer.update(record, replay.goals(step), settings)
        self.step = step

    def set_layers(self, changes: Mapping[str, Any]) -> None:
        """Change layers; raises LayersError."""
        if self._viewer is not None:
            self._viewer.set_layers({k: v for k, v in changes.items() if k != "path"})
        self._layers.update(changes)
        self._draw_paths()

    def set_theme(self, name: str) -> None:
        """Switch between "dark" and "light"; raises ThemeError."""
        theme(name)
        self._theme = name
        if self._viewer is not None:
            self._viewer.set_theme(name)
            self._draw_paths()

    def set_camera(self, preset: str) -> None:
        """Move the camera; raises CameraError."""
        if self._viewer is not None:
            self._viewer.set_camera(preset)
            self._camera = self._viewer.camera

    def set_detail(self, detail: str) -> None:
        """Draw with floor, shadows and reflections ("full"), or without ("plain").

        Raises:
            ReviewError: If it is neither.
        """
        if detail not in get_args(Detail):
            raise ReviewError(f"detail is {detail!r}; valid: {', '.join(get_args(Detail))}")
        if detail == self._detail:
            return
        self._detail = cast(Detail, detail)
        if self.replay is not None:
            self._rebuild(self.replay)
            self._begin(self.replay, self.step)

    def set_path(self, points: Sequence[float]) -> None:
        """Draw where the hand would have gone: x y z after x y z [m]; empty: nothing.

        Raises:
            ReviewError: If these are no points.
        """
        if len(points) % 3 or not all(isinstance(p, int | float) for p in points):
            raise ReviewError("a path is a list of numbers, three for each point")
        self._paths["what-if"] = np.array(points, dtype=float).reshape(-1, 3)
        self._draw_paths()

    @property
    def layers(self) -> dict[str, Any]:
        """All layers as they are."""
        known = self._viewer.layers if self._viewer is not None else {}
        return {**known, **self._layers}

    @property
    def value_range(self) -> tuple[float, float] | None:
        """Ends of the slice's legend [nat]."""
        return self._viewer.value_range if self._viewer is not None else None

    def close(self) -> None:
        """Stop drawing."""
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None

    def _begin(self, replay: Replay, step: int) -> None:
        """Draw what a trial adds to its scene."""
        assert self._viewer is not None
        self.replay, self._scene_json = replay, replay.header.scene_json
        self._viewer.clear_path()
        self._viewer.set_target(replay.header.instructed_goal)
        self._paths = {"log": replay.log.steps["hand_position_m"]}
        self._draw_paths()
        self.draw(step)

    def _rebuild(self, replay: Replay) -> None:
        """Draw another scene, with theme, layers and camera as they are."""
        self.close()
        self.server.scene.reset()
        self._viewer = Viewer(self.server, replay.scene, self._theme, detail=self._detail)
        known = {k: v for k, v in self._layers.items() if k != "path"}
        if known.get("slice_of") not in ("belief", "soft-min", None, *replay.header.goal_names):
            known["slice_of"] = self._layers["slice_of"] = "belief"
        self._viewer.set_layers({**known, "path": False})
        self._viewer.set_camera(self._camera)

    def _draw_paths(self) -> None:
        if self._viewer is None:
            return
        colours = theme(self._theme)
        with self.server.atomic():
            for kind, node in PATH_NODES.items():
                points = self._paths.get(kind, np.empty((0, 3)))
                shown = len(points) > 1 and (kind == "what-if" or self._layers.get("path", False))
                points = points[:: max(1, len(points) // MAX_PATH_POINTS)]
                segments = np.stack([points[:-1], points[1:]], axis=1)
                if kind == "what-if":
                    segments = segments[::2]  # dashed, as in the plots
                if not shown:
                    segments = np.zeros((1, 2, 3))
                self.server.scene.add_line_segments(
                    node,
                    segments.astype(np.float32),
                    rgb(colours.line if kind == "log" else colours.assist),
                    thickness=1.6 if kind == "log" else 3.0,
                    thickness_units="screen",
                    visible=shown,
                )
        self.server.flush()


def methods_at(replay: Replay, step: int) -> dict[str, list[float]]:
    """What each method would have asked for at a running step: method → twist (6,).

    The logged belief, state and input, and the settings in force; empty for other steps.
    """
    steps = replay.log.steps
    if step == 0 or steps["phase"][step] != "running":
        return {}
    settings, goals = replay.settings(step), replay.goals(step - 1)
    state = initial_state(goals, settings, steps["belief"][step])
    direct = steps["direct_twist"][step]
    asked = counterfactuals(settings, goals, state, replay.pose(step - 1), direct)
    return {method: twist.tolist() for method, twist in asked.items()}
