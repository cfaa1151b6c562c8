"""What the owner of the clock knows about a tick."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Stamps:
    """Times and health of one tick; zeros where there is no clock.

    Attributes:
        monotonic_s: This machine's monotonic clock at the tick's beginning [s].
        wall_s: Seconds since 1970.
        lateness_s: How late the tick began [s].
        round_trip_ms: As measured by the page.
        skipped: Ticks that were lost before this one.
        loss: Why there is no user input; empty: there is, or there is no watchdog.
    """

    monotonic_s: float = 0.0
    wall_s: float = 0.0
    lateness_s: float = 0.0
    round_trip_ms: float = 0.0
    skipped: int = 0
    loss: str = ""


NO_STAMPS = Stamps()
