"""The worker's part of `hello`: what the page needs once."""

from collections.abc import Mapping, Sequence
from typing import Any

from app import __version__
from app.core import METHODS
from app.robot.scene import Scene
from app.robot.scene_file import list_scenes
from app.session.frame import TrialView
from app.session.status import redact

PAGE_HUES = {
    "green": "canteen",
    "vermilion": "block",
    "sky": "glass",
    "orange": "goal-4",
    "blue": "goal-5",
}
"""A scene's hue → its token in the page's style sheet."""


def hello_message(
    session: str,
    scene: Scene,
    view: TrialView,
    method: str,
    layers: Mapping[str, Any],
    *,
    recorded: bool,
    hold_on_loss: bool,
    watch: str | None,
    hide: Sequence[str],
) -> dict[str, Any]:
    """The `hello` message of the contract; the web process adds who has control.

    Args:
        session: The session's id.
        scene: The scene that is shown.
        view: The trial that is shown.
        method: Its method.
        layers: The drawn layers.
        recorded: Whether trials are recorded.
        hold_on_loss: Whether lost input stops the arm.
        watch: Path of the read-only link.
        hide: What must not reach the browser.
    """
    objects = [
        {"name": item.name, "colour": PAGE_HUES[item.colour], "kind": item.kind}
        for item in scene.objects
    ]
    message: dict[str, Any] = {
        "type": "hello",
        "session": session,
        "version": __version__,
        "scene": {"name": scene.name, "title": scene.title, "objects": objects},
        "scenes": list(list_scenes()),
        "methods": list(METHODS),
        "settings": dict(view.settings),
        "layers": dict(layers),
        "recorded": recorded,
        "hold_on_loss": hold_on_loss,
        "watch": watch,
        "view": f"/view/{session}/",
        "control": False,
        "trial": {
            "number": view.number,
            "target": view.target,
            "method": method,
            "shown_as": view.shown_as,
            "scene": view.scene,
            "seed": view.seed,
            "simulated": view.simulated,
            "phase": "ready",
            "outcome": "running",
            "seconds": 0.0,
            "input": 0.0,
            "grasped": "",
        },
    }
    redact(message, hide)
    return message
