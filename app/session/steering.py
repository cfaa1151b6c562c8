"""D(u) and ‖u‖ of the newest input."""

import math

from app.core import AssistanceSettings, UserInput, compute_command
from app.core.types import Array


class Steering:
    """Remembers the last result: inputs come more slowly than ticks, often one serves several."""

    def __init__(self) -> None:
        self._input: UserInput | None = None
        self._settings: AssistanceSettings | None = None
        self._result: tuple[Array, float]

    def command(self, user_input: UserInput, settings: AssistanceSettings) -> tuple[Array, float]:
        """D(u) [m/s, rad/s], (6,), not to be written to, and ‖u‖₂ after the dead zone."""
        if user_input is not self._input or settings is not self._settings:
            direct = compute_command(user_input, settings)
            direct.setflags(write=False)
            self._input, self._settings = user_input, settings
            self._result = direct, input_norm(direct, settings)
        return self._result


def input_norm(direct: Array, settings: AssistanceSettings) -> float:
    """‖u‖₂ from D(u), which is u times the speed at full stick."""
    x, y, z, roll, pitch, yaw = direct.tolist()
    return math.hypot(
        math.hypot(x, y, z) / settings.full_stick_speed,
        math.hypot(roll, pitch, yaw) / settings.full_stick_angular_speed,
    )
