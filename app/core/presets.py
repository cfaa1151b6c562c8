"""Named settings: the paper's formulas, its authors' released constants, and our defaults."""

import math
from typing import Any

from app.core.errors import CoreError
from app.core.settings import AssistanceSettings, settings_from_dict

PRESETS: dict[str, dict[str, Any]] = {
    # The formulas as published: running cost α min(1, d/δ) without offset, p(u|x,g) with the
    # running cost once per pass of a 40 Hz loop, soft-min over targets (Theorem 2), no bounds on
    # the belief but the rounding guard. The paper prints no constants: α, δ and w are `ada`'s.
    "paper": {
        "predictor": "paper",
        "prediction_period": 0.025,
        "temperature": 1.0,
        "belief_floor": 0.0,
        "translation_offset": 0.0,
        "rotation_offset": 0.0,
    },
    # The constants of the authors' released code, which predicts with the minimum over targets,
    # once per call, and limits neither speed nor acceleration.
    "ada": {
        "predictor": "paper",
        "prediction_period": 0.0,
        "temperature": 0.0,
        "belief_max": 0.99,
        "belief_floor": 0.0,
        "belief_surplus": "equal",
        "max_speed": math.inf,
        "max_angular_speed": math.inf,
        "max_acceleration": math.inf,
        "max_angular_acceleration": math.inf,
    },
    # Argued in docs/method.md.
    "default": {"translation_aside": 1.5},
}

METHOD_DEFAULTS: dict[str, dict[str, Any]] = {
    # Argued in docs/method.md: stronger help is felt as help where it gives way.
    "yielding": {
        "gain": 2.0,
        "beta": 24.0,
        "w_l": 100.0,
        "translation_offset": 1.5,
        "step": "exact",
        "idle_drift": 1.0,
    },
}


def preset(name: str = "default", **changes: Any) -> AssistanceSettings:
    """Return the settings of a preset with some fields changed, e.g. `method="blend"`.

    Under `default`, a method may bring its own defaults (`yielding`: stronger help); `changes`
    win.

    Raises:
        CoreError: If the preset or a field is unknown or a value is not valid.
    """
    if name not in PRESETS:
        raise CoreError(f"preset must be one of {', '.join(PRESETS)}, got {name!r}")
    values = dict(PRESETS[name])
    if name == "default":
        values.update(METHOD_DEFAULTS.get(str(changes.get("method")), {}))
    return settings_from_dict(values | changes)
