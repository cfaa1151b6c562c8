"""Methods by text: `method[:variant][@setting=value]…`, e.g. `blend:probability-gate@gain=2`.

A variant is one choice of the method's own: of `blend` its arbitration (`distance` is what plain
`blend` means) or `replace`; of `policy` and `yielding` how they optimise. What follows an @ is any
setting of docs/method.md.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from app.core import ARBITRATIONS, METHODS, PRESETS, AssistanceSettings, CoreError, preset
from app.core.settings import FIELD_NAMES
from app.simulate.errors import SimulateError

_POLICY_VARIANTS: dict[str, dict[str, Any]] = {
    "first-order": {"step": "first-order"},
    "exact": {"step": "exact"},
    "both-act": {"takeover": "both-act"},
}
VARIANTS: dict[str, dict[str, dict[str, Any]]] = {
    "blend": {name: {"arbitration": name} for name in ARBITRATIONS}
    | {"replace": {"blend_replace": True}},
    "policy": _POLICY_VARIANTS,
    "yielding": _POLICY_VARIANTS,
}
"""Method → variant → settings."""


@dataclass(frozen=True)
class MethodSpec:
    """A method with its settings.

    Attributes:
        name: The text it was given as.
        settings: Complete.
        differs: What differs from the preset, by setting.
    """

    name: str
    settings: AssistanceSettings
    differs: Mapping[str, Any]


def parse_methods(
    text: str, preset_name: str = "default", common: Mapping[str, Any] | None = None
) -> tuple[MethodSpec, ...]:
    """Read a comma-separated list of methods.

    Args:
        text: As above.
        preset_name: Where all settings come from that are not named.
        common: Settings of all methods; those named with a method win.

    Raises:
        SimulateError: Naming what is unknown, and what is valid.
    """
    if preset_name not in PRESETS:
        raise SimulateError(f"preset is {preset_name!r}; valid: {', '.join(PRESETS)}")
    names = [part.strip() for part in text.split(",") if part.strip()]
    if not names:
        raise SimulateError(f"no methods in {text!r}; valid: {', '.join(METHODS)}")
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise SimulateError(f"methods are given twice: {', '.join(sorted(twice))}")
    return tuple(_parse(name, preset_name, common or {}) for name in names)


def describe_methods() -> str:
    """What may be asked for, a line a method."""
    lines = [
        f"  {name}" + (f":{'|'.join(VARIANTS[name])}" if name in VARIANTS else "")
        for name in METHODS
    ]
    return "\n".join([*lines, "each with any number of @setting=value"])


def _parse(text: str, preset_name: str, common: Mapping[str, Any]) -> MethodSpec:
    head, *changes = text.split("@")
    method, colon, variant = head.partition(":")
    if method not in METHODS:
        raise SimulateError(f"method {method!r} is unknown; valid: {', '.join(METHODS)}")
    differs: dict[str, Any] = dict(common)
    if colon:
        variants = VARIANTS.get(method, {})
        if variant not in variants:
            valid = ", ".join(variants) or "none"
            raise SimulateError(f"{method} has no variant {variant!r}; valid: {valid}")
        differs |= variants[variant]
    for change in changes:
        name, equals, value = change.partition("=")
        if not equals or name not in FIELD_NAMES or name == "method":
            valid = ", ".join(n for n in FIELD_NAMES if n != "method")
            raise SimulateError(f"{text}: {change!r} is no setting=value; settings: {valid}")
        differs[name] = _value(value)
    try:
        settings = preset(preset_name, method=method, **differs)
    except CoreError as error:
        raise SimulateError(f"{text}: {error}") from None
    return MethodSpec(text, settings, differs)


def _value(text: str) -> Any:
    if text in ("true", "false"):
        return text == "true"
    try:
        return float(text) if text != "inf" else text
    except ValueError:
        return text
