"""The parameters of simulated users, with unit, default and what is possible."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number that differs between people.

    Attributes:
        default: Where a population says nothing.
        low: Smallest possible value.
        high: Largest possible value.
        about: Meaning and unit, in a phrase.
    """

    default: float
    low: float
    high: float
    about: str


COMMON: dict[str, Parameter] = {
    "delay_s": Parameter(0.25, 0.0, 2.0, "reaction: the hand is seen as it was this long ago [s]"),
    "vigour": Parameter(0.28, 0.02, 1.0, "deflection far from the goal, full stick = 1"),
    "noise": Parameter(0.5, 0.0, 3.0, "SD of the motor noise per axis, as a share of the input"),
    "noise_time_s": Parameter(0.3, 0.02, 5.0, "correlation time of the motor noise [s]"),
    "axis_preference": Parameter(
        0.5, 0.0, 1.0, "0: all axes at once; 1: only the axis that is farthest off"
    ),
    "slow_down_m": Parameter(0.06, 0.0, 0.5, "distance from which the input grows smaller [m]"),
    "standoff_m": Parameter(
        0.05, 0.0, 0.2, "how far before a grasp it is lined up with, from the side [m]"
    ),
    "tolerance_m": Parameter(0.010, 0.001, 0.05, "the hand is closed within this of a grasp [m]"),
    "tolerance_rad": Parameter(0.25, 0.01, 1.0, "and within this angle of it [rad]"),
    "turn_vigour": Parameter(0.6, 0.02, 1.0, "deflection while turning the hand, full stick = 1"),
    "patience_s": Parameter(
        0.5, 0.0, 30.0, "at a grasp, how long before one turns the hand oneself [s]"
    ),
}
"""What every user has: senses, hands and judgement."""
