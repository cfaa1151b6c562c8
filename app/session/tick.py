"""What one tick of a trial leaves behind where no record is wanted."""

from typing import NamedTuple

from app.core.types import Array
from app.recording.schema import Phase


class Tick(NamedTuple):
    """What the measures of a trial need of one tick; the record holds the same and all the rest.

    Attributes:
        phase: In this tick.
        input_norm: ‖u‖₂, full stick = 1.
        direct: D(u), (6,).
        assistance: What the method adds, (6,); zero unless the trial is running.
        executed: The twist that was taken, (6,).
        belief: b(g), (n_goals,).
    """

    phase: Phase
    input_norm: float
    direct: Array
    assistance: Array
    executed: Array
    belief: Array
