"""The assistance of one trial: its settings as they change, its state, its last step."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from app.core import (
    METHODS,
    AssistanceSettings,
    CoreError,
    Goals,
    Pose,
    assist,
    counterfactuals,
    initial_state,
    known_goal_twist_of_step,
    settings_from_dict,
)
from app.core.presets import METHOD_DEFAULTS
from app.core.types import Array
from app.session.commands import CommandError

STILL = np.zeros(6)
STILL.setflags(write=False)


class Assistant:
    """Owns the belief and the settings; the settings may change between two updates.

    Attributes:
        settings: As they are now.
        step: Result of the last update; before the first, what zero input gives.
    """

    def __init__(
        self, settings: AssistanceSettings, goals: Goals, pose: Pose, dt: float, preset: str
    ) -> None:
        """Begin with the prior.

        Args:
            settings: To begin with.
            goals: With their targets in the world frame.
            pose: The hand's.
            dt: Length of a tick [s].
            preset: Where the settings come from; under "default" a method brings its own.
        """
        self._preset = preset
        self._dt = dt
        self._set(settings)
        self._goals, self._pose, self._direct = goals, pose, STILL
        self._state = initial_state(goals, settings)
        _, self.step = assist(settings, goals, self._state, pose, STILL, dt)

    @property
    def belief(self) -> Array:
        """b(g), shape (n_goals,)."""
        return self.step.belief

    def update(self, goals: Goals, pose: Pose, direct: Array, *, stopped: bool) -> Array:
        """One tick.

        Args:
            goals: Where they are now.
            pose: The hand's.
            direct: D(u) [m/s, rad/s], (6,).
            stopped: The arm shall come to rest: direct control with zero input, so that it slows
                down within the same limits and the belief stays.

        Returns:
            The executed twist, (6,).
        """
        settings = self._direct_settings if stopped else self.settings
        self._goals, self._pose = goals, pose
        self._direct = STILL if stopped else direct
        self._state, self.step = assist(settings, goals, self._state, pose, self._direct, self._dt)
        return self.step.twist

    def known_goal_assistance(self, goal: int) -> Array:
        """What the last update would have added had the goal been known, (6,)."""
        if not self.settings.enabled:
            return STILL
        return known_goal_twist_of_step(self.settings, self.step, goal) - self._direct

    def counterfactuals(self) -> dict[str, Array]:
        """What each method would have asked for in the last update: method → twist (6,)."""
        return counterfactuals(self.settings, self._goals, self._state, self._pose, self._direct)

    def change(self, changes: Mapping[str, Any]) -> None:
        """Change settings by name.

        Raises:
            CommandError: Naming the setting, its value and what is valid; nothing is changed.
        """
        self._set(change_settings(self.settings, changes))

    def change_method(self, method: str) -> None:
        """Switch the method, and what it brings along.

        Raises:
            CommandError: If there is no such method.
        """
        self.change(method_changes(self.settings, method, self._preset))

    def _set(self, settings: AssistanceSettings) -> None:
        direct = settings_from_dict({"method": "direct"}, settings)
        self.settings, self._direct_settings = settings, direct


def method_changes(settings: AssistanceSettings, method: str, preset: str) -> dict[str, Any]:
    """What a switch of the method changes.

    Under the default preset a method's own defaults come and go with it, except in fields that
    somebody has changed.

    Raises:
        CommandError: If there is no such method.
    """
    if method not in METHODS:
        raise CommandError(f"method is {method!r}; valid: {', '.join(METHODS)}")
    changes: dict[str, Any] = {"method": method}
    if preset != "default":
        return changes
    plain = AssistanceSettings()
    for name, value in METHOD_DEFAULTS.get(settings.method, {}).items():
        if getattr(settings, name) == value:
            changes[name] = getattr(plain, name)
    for name, value in METHOD_DEFAULTS.get(method, {}).items():
        if changes.get(name, getattr(settings, name)) == getattr(plain, name):
            changes[name] = value
    return changes


def change_settings(settings: AssistanceSettings, changes: Mapping[str, Any]) -> AssistanceSettings:
    """The settings with some changed by name.

    Raises:
        CommandError: Naming the setting, its value and what is valid.
    """
    try:
        return settings_from_dict(changes, settings)
    except CoreError as error:
        raise CommandError(str(error)) from None
