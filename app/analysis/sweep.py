"""Sweeps: one parameter of method, user or scene after another, against the measures.

SWEEP.yaml:

    name: gain-and-delay
    base: {methods: [blend, policy], trials: 60, users: paper-like, world: kinematic, seed: 1}
    vary:
      - {parameter: settings.gain, values: [0.5, 0.75, 1.0, 1.5]}
      - {parameter: user.delay_s, from: 0.1, to: 0.5, count: 5}
    design: grid            # or one-at-a-time: the others stay as in base
    measures: [time_s, input_s, felt_control]
    against: blend          # optional: draw blend's mean ÷ each other method's instead
    marks: {time_s: 1.55}   # optional: a value to compare with, drawn as a line

What `base` may hold and what parameters exist is the simulation's to say; it is called once per
point with `base` and the point's values under "parameters".
"""

from collections.abc import Callable, Mapping
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from app.analysis.errors import AnalysisError
from app.analysis.frames import Frame, pd
from app.core.measures import MEASURE_NAMES

RunStudy = Callable[[dict[str, Any]], Frame]
"""Configuration of one point → rows of the trials table."""

POINT_LIMIT = 2000


class Varied(BaseModel):
    """One parameter and the values it takes, listed or as a range."""

    model_config = ConfigDict(extra="forbid", populate_by_name=True)

    parameter: str = Field(min_length=1)
    values: list[float | str | bool] = []
    low: float | None = Field(default=None, alias="from")
    high: float | None = Field(default=None, alias="to")
    count: int = Field(default=5, ge=2, le=200)
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _one_kind(self) -> "Varied":
        ranged = self.low is not None and self.high is not None
        if bool(self.values) == ranged:
            raise ValueError(f"{self.parameter}: give either values, or both from and to")
        if ranged and self.scale == "log" and min(self.low or 0.0, self.high or 0.0) <= 0.0:
            raise ValueError(f"{self.parameter}: a log scale needs from and to above 0")
        return self

    def levels(self) -> list[float | str | bool]:
        """The values in order."""
        if self.values:
            return list(self.values)
        assert self.low is not None and self.high is not None
        space = np.linspace if self.scale == "linear" else np.geomspace
        return [float(f"{v:.6g}") for v in space(self.low, self.high, self.count)]


class Sweep(BaseModel):
    """A validated SWEEP.yaml."""

    model_config = ConfigDict(extra="forbid")

    name: str = Field(min_length=1)
    base: dict[str, Any] = {}
    vary: list[Varied] = Field(min_length=1)
    design: Literal["grid", "one-at-a-time"] = "grid"
    measures: list[str] = ["time_s", "input_s", "felt_control"]
    against: str | None = None
    marks: dict[str, float] = {}

    @model_validator(mode="after")
    def _known(self) -> "Sweep":
        unknown = [m for m in self.measures if m not in (*MEASURE_NAMES, "success")]
        if unknown or not self.measures:
            valid = ", ".join((*MEASURE_NAMES, "success"))
            raise ValueError(f"unknown measures {unknown}; valid are {valid}")
        names = [v.parameter for v in self.vary]
        if len(set(names)) < len(names):
            raise ValueError(f"a parameter is varied twice: {', '.join(names)}")
        if len(self.points()) > POINT_LIMIT:
            raise ValueError(f"{len(self.points())} points; at most {POINT_LIMIT} are run")
        return self

    def points(self) -> list[dict[str, Any]]:
        """Parameter values of every run, in order."""
        if self.design == "grid":
            names = [v.parameter for v in self.vary]
            combinations = product(*(v.levels() for v in self.vary))
            return [dict(zip(names, values, strict=True)) for values in combinations]
        return [{v.parameter: value} for v in self.vary for value in v.levels()]


def load_sweep(path: Path) -> Sweep:
    """Read and validate a SWEEP.yaml.

    Raises:
        AnalysisError: Naming file, field and what is valid.
    """
    try:
        document = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeError, YAMLError) as error:
        raise AnalysisError(f"{path} cannot be read: {error}") from None
    if not isinstance(document, Mapping):
        raise AnalysisError(f"{path} is no mapping; it needs name, base and vary")
    try:
        return Sweep.model_validate(document)
    except ValidationError as error:
        said = "; ".join(
            f"{'.'.join(map(str, e['loc'])) or 'sweep'}: {e['msg']}" for e in error.errors()
        )
        raise AnalysisError(f"{path}: {said}") from None


def run_sweep(
    sweep: Sweep, run_study: RunStudy, progress: Callable[[str], None] = lambda text: None
) -> Frame:
    """Run every point; returns its trials with one column per varied parameter.

    Args:
        sweep: What to vary.
        run_study: Called with {**base, "parameters": {name: value}} once per point.
        progress: Told before each point.
    """
    points = sweep.points()
    parts = []
    for i, point in enumerate(points):
        told = ", ".join(f"{name} = {value}" for name, value in point.items())
        progress(f"point {i + 1} of {len(points)}: {told}")
        rows = run_study({**sweep.base, "parameters": point})
        parts.append(rows.assign(**{name: point.get(name) for name in sweep_columns(sweep)}))
    return pd.concat(parts, ignore_index=True)


def sweep_columns(sweep: Sweep) -> list[str]:
    """Names of the varied parameters: columns of the rows; empty where a point leaves one."""
    return [v.parameter for v in sweep.vary]


def summarise_sweep(rows: Frame, sweep: Sweep) -> Frame:
    """Mean and standard error over participants of every measure, per point and method.

    Columns: parameter, level, method, measure, mean, se, n; in a grid each level is averaged over
    the other parameters. `success` is the share of all trials; the others are of successful ones.
    With `against`, "mean" is that method's mean ÷ the method's over the participants of both, and
    its standard error is the jackknife's.

    Raises:
        AnalysisError: If `against` is not among the methods that were run.
    """
    if sweep.against is not None and sweep.against not in set(rows["method"]):
        ran = ", ".join(sorted(set(rows["method"])))
        raise AnalysisError(f"against is {sweep.against!r}; valid: {ran}")
    tables = []
    for varied in sweep.vary:
        name = varied.parameter
        # In a one-at-a-time design the other parameters' points leave this one's column empty.
        there = rows[rows[name].notna()]
        for measure in sweep.measures:
            used = there if measure == "success" else there[there["success"].astype(bool)]
            used = used.assign(value=used[measure].astype(float)).dropna(subset=["value"])
            people = used.groupby([name, "method", "participant_id"])["value"].mean()
            if sweep.against is None:
                table = people.groupby([name, "method"]).agg(["mean", "sem", "size"]).reset_index()
                table = table.rename(columns={name: "level", "sem": "se", "size": "n"})
            else:
                table = _ratios(people, sweep.against)
            tables.append(table.assign(parameter=name, measure=measure))
    columns = ["parameter", "level", "method", "measure", "mean", "se", "n"]
    return pd.concat(tables, ignore_index=True)[columns]


def _ratios(people: Any, against: str) -> Frame:
    """Mean of `against` ÷ mean of each other method, per level."""
    found = []
    for level, wide in people.unstack("method").groupby(level=0):
        for method in wide.columns.drop(against):
            both = wide[[against, method]].dropna().to_numpy()
            n = len(both)
            if n < 2:
                continue
            left_out = (both.sum(axis=0) - both) / (n - 1)
            each = left_out[:, 0] / left_out[:, 1]
            ratio = both[:, 0].mean() / both[:, 1].mean()
            se = float(np.sqrt((n - 1) / n * ((each - each.mean()) ** 2).sum()))
            found.append({"level": level, "method": method, "mean": ratio, "se": se, "n": n})
    return pd.DataFrame(found, columns=["level", "method", "mean", "se", "n"])
