"""Every number of the assistance, with its unit; one frozen, validated object."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

from app.core.errors import CoreError
from app.core.types import Array

Predictor = Literal["calibrated", "paper"]
Arbitration = Literal["distance", "distance-gate", "probability-gate"]
Step = Literal["first-order", "exact"]
Magnitude = Literal["free", "fixed"]
Takeover = Literal["takes-over", "both-act"]
Surplus = Literal["proportional", "equal"]

METHOD_NAMES = ("direct", "blend", "policy", "yielding", "autonomy")


@dataclass(frozen=True)
class AssistanceSettings:
    """The method, its options, the costs and the limits.

    Weights w charge the robot w |a − D(u)|² nat per second for deviating from the user; costs are
    in nat per second, so that exp(−V) is a probability up to scale.

    Raises:
        CoreError: If a field has a value that is not valid; the message names field and range.
    """

    method: str = "policy"  # one of METHODS
    enabled: bool = True  # off: the executed twist is D(u), the belief goes on
    gain: float = 1.0  # γ in [0, 2], scales what the method adds
    # blend
    arbitration: Arbitration = "distance"  # how c follows from confidence
    arbitration_distance: float = 0.20  # D [m] of c = max(0, 1 − d/D)
    gate_distance: float = 0.10  # [m], distance-gate: c = 1 inside
    gate_probability: float = 0.4  # probability-gate: c = 1 where p₁ − p₂ exceeds it
    blend_replace: bool = False  # P_g = A_g alone instead of D(u) + A_g
    # prediction
    predictor: Predictor = "calibrated"
    beta: float = 32.0  # calibrated: evidence per nat of progress and look-ahead
    prediction_period: float = 0.025  # paper: time between two conditionings [s]; 0: every call
    temperature: float = 1.0  # of the soft-min over targets; 0: the minimum
    belief_max: float = 0.99  # no goal is believed more
    belief_floor: float = 0.005  # no goal is believed less
    belief_surplus: Surplus = "proportional"  # who gets what belief_max takes away
    idle_drift: float = 0.0  # η [nat/s], toward goals near the hand while the user is idle
    evidence_half_life: float = math.inf  # [s]; inf: evidence does not age
    prior: tuple[float, ...] = ()  # p(g) before any input, in the goals' order; (): uniform
    # policy
    step: Step = "first-order"  # of the argmin over the translation
    magnitude: Magnitude = "free"  # fixed: executed at the user's speed
    takeover: Takeover = "takes-over"  # both-act: experimental, policy and yielding only
    user_speed: float = 0.056  # [m/s], both-act: what the user is expected to push with
    w_translation: float = 20.0  # w [nat s/m²]
    w_rotation: float = 0.025  # w [nat s/rad²]
    # yielding, as charged for translation; rotation is charged in proportion
    w_f: float = math.inf  # against the user's direction [nat s/m²]
    w_l: float = 20.0  # across the user's direction [nat s/m²]
    yield_full_input: float = 0.25  # |u| (full stick = 1) from which w_f and w_l count in full
    # the user's cost per second: α min(1, d/δ) + c₀, and the speed the robot takes over with
    translation_alpha: float = 2.25  # α [nat/s]
    translation_delta: float = 0.07  # δ [m]
    translation_offset: float = 0.2  # c₀ [nat/s]
    translation_speed: float = 1.0  # v_to [m/s]
    translation_aside: float = 1.0  # a, metres along a grasp's approach that one aside of it counts
    rotation_alpha: float = 0.20  # [nat/s]
    rotation_delta: float = math.pi / 32  # [rad]
    rotation_offset: float = 0.01  # [nat/s]
    rotation_speed: float = 1.0  # [rad/s]
    rotation_weight: float = 0.07  # m in V = V_translation + m V_rotation
    look_ahead: float = 0.1  # τ [s]
    # limits of the executed twist; inf: none
    max_speed: float = 0.40  # [m/s]
    max_angular_speed: float = 1.2  # [rad/s]
    max_acceleration: float = 2.0  # [m/s²]
    max_angular_acceleration: float = 8.0  # [rad/s²]
    # direct teleoperation
    full_stick_speed: float = 0.2  # [m/s]
    full_stick_angular_speed: float = 0.4  # [rad/s]

    def __post_init__(self) -> None:
        for name, (low, high, low_open) in _RANGES.items():
            value = getattr(self, name)
            number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
            inside = number and low <= value <= high and not (low_open and value == low)
            if not inside or (math.isinf(value) and name not in _MAY_BE_INFINITE):
                raise CoreError(f"{name} must be {_range_text(name)}, got {value!r}")
            object.__setattr__(self, name, float(value))
        for name, choices in _CHOICES.items():
            if getattr(self, name) not in choices:
                raise CoreError(
                    f"{name} must be one of {', '.join(choices)}, got {getattr(self, name)!r}"
                )
        for name in ("enabled", "blend_replace"):
            if not isinstance(getattr(self, name), bool):
                raise CoreError(f"{name} must be true or false, got {getattr(self, name)!r}")
        object.__setattr__(self, "prior", _checked_prior(self.prior))

    @cached_property
    def two_w(self) -> Array:
        """2w per axis of the twist, shape (6,)."""
        return np.repeat([2.0 * self.w_translation, 2.0 * self.w_rotation], 3)

    @cached_property
    def packed(self) -> Array:
        """The costs as the compiled kernels read them, in the order of `kernels.evaluate`."""
        return np.array(
            [
                self.translation_alpha,
                self.translation_delta,
                self.translation_offset,
                self.translation_speed,
                self.rotation_alpha,
                self.rotation_delta,
                self.rotation_offset,
                self.rotation_speed,
                self.rotation_weight,
                self.look_ahead,
                self.temperature,
                1.0 if self.predictor == "paper" else 0.0,
                self.belief_max,
                self.belief_floor,
                1.0 if self.belief_surplus == "equal" else 0.0,
                self.translation_aside,
            ]
        )


_UNBOUNDED = (0.0, math.inf)
_RANGES: dict[str, tuple[float, float, bool]] = {
    # field: lowest, highest, whether the lowest itself is excluded
    "gain": (0.0, 2.0, False),
    "arbitration_distance": (*_UNBOUNDED, True),
    "gate_distance": (*_UNBOUNDED, False),
    "gate_probability": (0.0, 1.0, False),
    "beta": (*_UNBOUNDED, False),
    "prediction_period": (*_UNBOUNDED, False),
    "temperature": (*_UNBOUNDED, False),
    "belief_max": (0.5, 1.0, False),
    "belief_floor": (0.0, 0.5, False),
    "idle_drift": (*_UNBOUNDED, False),
    "evidence_half_life": (*_UNBOUNDED, True),
    "user_speed": (*_UNBOUNDED, False),
    "w_translation": (*_UNBOUNDED, True),
    "w_rotation": (*_UNBOUNDED, True),
    "w_f": (*_UNBOUNDED, False),
    "w_l": (*_UNBOUNDED, False),
    "yield_full_input": (0.0, 1.0, True),
    "translation_alpha": (*_UNBOUNDED, False),
    "translation_delta": (*_UNBOUNDED, True),
    "translation_offset": (*_UNBOUNDED, False),
    "translation_speed": (*_UNBOUNDED, True),
    "translation_aside": (1.0, math.inf, False),
    "rotation_alpha": (*_UNBOUNDED, False),
    "rotation_delta": (*_UNBOUNDED, True),
    "rotation_offset": (*_UNBOUNDED, False),
    "rotation_speed": (*_UNBOUNDED, True),
    "rotation_weight": (*_UNBOUNDED, False),
    "look_ahead": (*_UNBOUNDED, True),
    "max_speed": (*_UNBOUNDED, True),
    "max_angular_speed": (*_UNBOUNDED, True),
    "max_acceleration": (*_UNBOUNDED, True),
    "max_angular_acceleration": (*_UNBOUNDED, True),
    "full_stick_speed": (*_UNBOUNDED, True),
    "full_stick_angular_speed": (*_UNBOUNDED, True),
}
_MAY_BE_INFINITE = {
    "evidence_half_life",
    "w_f",
    "w_l",
    "max_speed",
    "max_angular_speed",
    "max_acceleration",
    "max_angular_acceleration",
}
_HINTS = get_type_hints(AssistanceSettings)
_CHOICES: dict[str, tuple[str, ...]] = {
    "method": METHOD_NAMES,
    **{name: get_args(hint) for name, hint in _HINTS.items() if get_origin(hint) is Literal},
}
FIELD_NAMES = tuple(field.name for field in dataclasses.fields(AssistanceSettings))


def settings_to_dict(settings: AssistanceSettings) -> dict[str, Any]:
    """Return the settings as a flat dict of JSON values; infinity becomes the text "inf"."""
    values = {name: getattr(settings, name) for name in FIELD_NAMES}
    values["prior"] = list(settings.prior)
    return {
        name: "inf" if isinstance(value, float) and math.isinf(value) else value
        for name, value in values.items()
    }


def settings_from_dict(
    values: Mapping[str, Any], base: AssistanceSettings | None = None
) -> AssistanceSettings:
    """Return `base` (by default all defaults) with the named fields changed.

    Raises:
        CoreError: If a name is unknown or a value is not valid; the message names the field, the
            value and what is valid.
    """
    changes = {}
    for name, value in values.items():
        if name not in FIELD_NAMES:
            raise CoreError(f"unknown setting {name!r}, valid are {', '.join(FIELD_NAMES)}")
        changes[name] = math.inf if value == "inf" and name in _MAY_BE_INFINITE else value
    return dataclasses.replace(base or AssistanceSettings(), **changes)


def _range_text(name: str) -> str:
    low, high, low_open = _RANGES[name]
    above = f"above {low:g}" if low_open else f"at least {low:g}"
    if math.isinf(high):
        return f"a number {above}" + (" or inf" if name in _MAY_BE_INFINITE else ", finite")
    return f"a number {above} and at most {high:g}"


def _checked_prior(prior: Any) -> tuple[float, ...]:
    try:
        values = tuple(float(value) for value in prior)
    except (TypeError, ValueError) as error:
        raise CoreError(f"prior must be numbers above 0, one per goal, got {prior!r}") from error
    if not all(0.0 < value < math.inf for value in values):
        raise CoreError(f"prior must be numbers above 0, one per goal, got {prior!r}")
    return values
