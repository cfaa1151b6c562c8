"""Populations: YAML files of weighted user models with ranges of their parameters.

    name: paper-like
    description: Who these people are, and when that was fixed.
    parameters: {delay_s: [0.2, 0.3], noise: 0.5}      # of all models that have them
    users:
      - {model: continue, weight: 70}
      - {model: lazy, weight: 20, parameters: {content_cosine: 0.6}}

A parameter is a number, or [low, high]: drawn uniformly, once per user.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from app.robot.scene import Scene
from app.simulate.errors import SimulateError
from app.simulate.models import MODELS

FOLDER = Path(__file__).parent / "populations"
Range = tuple[float, float]


@dataclass(frozen=True)
class Kind:
    """One weighted model.

    Attributes:
        model: Name in MODELS.
        weight: Relative frequency, above 0.
        ranges: Lowest and highest value of every parameter of the model.
    """

    model: str
    weight: float
    ranges: Mapping[str, Range]


@dataclass(frozen=True)
class Population:
    """A validated population."""

    name: str
    description: str
    kinds: tuple[Kind, ...]

    def draw(self, rng: np.random.Generator) -> tuple[str, dict[str, float]]:
        """Draw one user: the model's name and the value of each of its parameters."""
        weights = np.array([kind.weight for kind in self.kinds])
        kind = self.kinds[int(rng.choice(len(weights), p=weights / weights.sum()))]
        return kind.model, {
            name: float(rng.uniform(low, high)) for name, (low, high) in kind.ranges.items()
        }

    def to_dict(self) -> dict[str, Any]:
        """As JSON values, every parameter spelled out."""
        return {
            "name": self.name,
            "description": self.description,
            "users": [
                {"model": k.model, "weight": k.weight, "parameters": _listed(k.ranges)}
                for k in self.kinds
            ],
        }


def list_populations() -> tuple[str, ...]:
    """Names of the shipped populations."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


def load_population(name: str | Path) -> Population:
    """Read a shipped population by name, or a YAML file.

    Raises:
        SimulateError: Naming the file, the field, its value and what is valid.
    """
    path = Path(name)
    if str(name) in list_populations():
        path = FOLDER / f"{name}.yaml"
    elif path.suffix not in (".yaml", ".yml"):
        shipped = ", ".join(list_populations())
        raise SimulateError(f"users {str(name)!r} are unknown; valid: {shipped}, or a YAML file")
    try:
        document = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeError, YAMLError) as error:
        raise SimulateError(f"{path} cannot be read: {error}") from None
    try:
        return _population(document, path.stem)
    except SimulateError as error:
        raise SimulateError(f"{path}: {error}") from None


def with_parameters(population: Population, values: Mapping[str, float]) -> Population:
    """The same people with some parameters fixed, in every model that has them.

    Raises:
        SimulateError: If no model of the population has the parameter, or the value is impossible.
    """
    for name in values:
        models = [k.model for k in population.kinds]
        if not any(name in MODELS[model].PARAMETERS for model in models):
            valid = ", ".join(sorted({n for m in models for n in MODELS[m].PARAMETERS}))
            raise SimulateError(
                f"no user of {population.name} has a parameter {name!r}; valid: {valid}"
            )
    kinds = []
    for kind in population.kinds:
        own = {n: v for n, v in values.items() if n in MODELS[kind.model].PARAMETERS}
        fixed = {n: _range(kind.model, n, v) for n, v in own.items()}
        kinds.append(replace(kind, ranges={**kind.ranges, **fixed}))
    return replace(population, kinds=tuple(kinds))


def check_possible(population: Population, scene: Scene) -> None:
    """Say why some users could not do their trials in this scene.

    Raises:
        SimulateError: If a model needs more objects than there are, or someone is too slow.
    """
    others = len(scene.objects) - 1
    for kind in population.kinds:
        needed = MODELS[kind.model].OTHER_OBJECTS
        if others < needed:
            raise SimulateError(
                f"{population.name} is impossible in scene {scene.name!r}: a user of the model "
                f"{kind.model} needs {needed} object beside the instructed one, there are {others}"
            )
        late = kind.ranges["delay_s"][1]
        if late >= scene.time_limit_s:
            raise SimulateError(
                f"{population.name} is impossible in scene {scene.name!r}: {kind.model} reacts "
                f"after {late:g} s, the trial ends at {scene.time_limit_s:g} s"
            )


def _population(document: Any, stem: str) -> Population:
    if not isinstance(document, Mapping):
        raise SimulateError(f"a population is a mapping with users, not {document!r}")
    _only(document, ("name", "description", "parameters", "users"), "population")
    users = document.get("users")
    if not isinstance(users, list) or not users:
        raise SimulateError(
            f"users is {users!r}; valid: a list of at least one {{model, weight, parameters}}"
        )
    common = _mapping(document.get("parameters"), "parameters")
    kinds = tuple(_kind(entry, common) for entry in users)
    for name in common:
        if not any(name in kind.ranges for kind in kinds):
            valid = ", ".join(sorted({n for kind in kinds for n in kind.ranges}))
            raise SimulateError(f"no user has the parameter {name!r}; valid: {valid}")
    name = str(document.get("name") or stem)
    return Population(name, str(document.get("description") or "").strip(), kinds)


def _kind(entry: Any, common: Mapping[str, Any]) -> Kind:
    if not isinstance(entry, Mapping):
        raise SimulateError(f"a user is a mapping with model and weight, not {entry!r}")
    _only(entry, ("model", "weight", "parameters"), "a user")
    model = entry.get("model")
    if model not in MODELS:
        raise SimulateError(f"model {model!r} is unknown; valid: {', '.join(MODELS)}")
    weight = entry.get("weight", 1)
    if not _number(weight) or not weight > 0.0:
        raise SimulateError(f"{model}: weight is {weight!r}; valid: a number above 0")
    known = MODELS[model].PARAMETERS
    own = _mapping(entry.get("parameters"), f"{model}: parameters")
    for name in own:
        if name not in known:
            raise SimulateError(
                f"{model} has no parameter {name!r}; valid: {', '.join(sorted(known))}"
            )
    given = {**{n: v for n, v in common.items() if n in known}, **own}
    ranges = {n: _range(model, n, given.get(n, p.default)) for n, p in known.items()}
    return Kind(str(model), float(weight), ranges)


def _range(model: str, name: str, value: Any) -> Range:
    known = MODELS[model].PARAMETERS[name]
    ends = list(value) if isinstance(value, list | tuple) else [value, value]
    inside = len(ends) == 2 and all(_number(v) and known.low <= v <= known.high for v in ends)
    if not inside or ends[0] > ends[1]:
        raise SimulateError(
            f"{model}: {name} is {value!r}; valid: a number from {known.low:g} to {known.high:g}, "
            f"or [low, high] within that ({known.about})"
        )
    return float(ends[0]), float(ends[1])


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _mapping(value: Any, where: str) -> Mapping[str, Any]:
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise SimulateError(f"{where} is {value!r}; valid: a mapping of names to values")
    return value


def _only(document: Mapping[str, Any], valid: tuple[str, ...], where: str) -> None:
    for key in document:
        if key not in valid:
            raise SimulateError(f"{where} has no field {key!r}; valid: {', '.join(valid)}")


def _listed(ranges: Mapping[str, Range]) -> dict[str, float | list[float]]:
    return {n: low if low == high else [low, high] for n, (low, high) in ranges.items()}
