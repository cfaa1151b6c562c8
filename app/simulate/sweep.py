"""One point of a sweep: what its parameters mean for a study."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from app.simulate.errors import SimulateError
from app.simulate.plan import make_study
from app.simulate.study import run_study
from app.simulate.table import to_table

BASE = ("methods", "users", "trials", "seed", "world", "scene", "preset")
"""What `base` may hold, and what a parameter may be besides `settings.…` and `user.…`."""


def run_point(config: Mapping[str, Any], workers: int) -> pd.DataFrame:
    """Run the study of one point; rows of the trials table.

    Args:
        config: The sweep's `base`, and under "parameters" the point's values: `settings.<name>`
            of all methods, `user.<name>` of all users that have it, or one of BASE.
        workers: Processes; 0: every core.

    Raises:
        SimulateError: Naming what is unknown, and what is valid.
    """
    base = {name: value for name, value in config.items() if name != "parameters"}
    settings: dict[str, Any] = {}
    users: dict[str, float] = {}
    for name, value in config.get("parameters", {}).items():
        kind, dot, rest = name.partition(".")
        if dot and kind == "settings":
            settings[rest] = value
        elif dot and kind == "user":
            users[rest] = value
        elif name in BASE:
            base[name] = value
        else:
            valid = f"settings.<setting>, user.<parameter>, {', '.join(BASE)}"
            raise SimulateError(f"parameter {name!r} is unknown; valid: {valid}")
    for name in base:
        if name not in BASE:
            raise SimulateError(f"base has no field {name!r}; valid: {', '.join(BASE)}")
    methods = base.get("methods", "blend,policy")
    base["methods"] = methods if isinstance(methods, str) else ",".join(map(str, methods))
    for name in ("trials", "seed"):
        if name in base:
            base[name] = _whole(name, base[name])
    study = make_study(**base, settings=settings, user_parameters=users)
    run = run_study(study, workers=workers)
    if not run.complete:
        raise KeyboardInterrupt  # half a point answers nothing
    return to_table(run.rows, calibration=False).to_pandas()


def _whole(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int | float) or value != int(value):
        raise SimulateError(f"{name} is {value!r}; valid: a whole number")
    return int(value)
