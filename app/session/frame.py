"""What the readers of a tick are given: its record and what does not change every tick."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from app.core import AssistanceSettings, Goals
from app.recording.schema import StepRecord
from app.session.loop import Health


@dataclass(frozen=True, slots=True)
class TrialView:
    """What the page is told of a trial; replaced as a whole where something changes.

    Attributes:
        number: Of the trial's log.
        target: The instructed goal.
        shown_as: What the participant sees instead of the method's name.
        scene: Name of the scene.
        seed: Of the layout.
        goal_names: In the order of the record's belief.
        object_names: In the order of the record's object_poses.
        object_heights_m: Of each object, standing [m].
        settings: All settings by name.
        simulated: Whether a simulated user steers now.
    """

    number: int
    target: str
    shown_as: str
    scene: str
    seed: int
    goal_names: tuple[str, ...]
    object_names: tuple[str, ...]
    object_heights_m: tuple[float, ...]
    settings: Mapping[str, Any]
    simulated: bool = False


class Frame(NamedTuple):
    """One tick, for the viewer and the page."""

    record: StepRecord
    view: TrialView
    goals: Goals
    """Targets in the world frame."""
    settings: AssistanceSettings
    seconds: float
    """Time as measured: stands still from the command that closes the hand."""
    outcome: str
    grasped: str
    health: Health
    loss: str = ""
    """Why there is no input, of `watchdog.Loss`; empty: there is."""
