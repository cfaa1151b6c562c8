"""What a simulated study is: its configuration, and which user does which trial of it.

Trial i is a pair (or more): every method meets the same scene, goal, user and noise. A user does
one trial for every object of the scene, in random order; everything random follows from the
study's seed and the numbers of user and trial, never from which process does it.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from app.core import settings_to_dict
from app.robot.scene import Scene
from app.robot.scene_file import load_scene
from app.simulate.errors import SimulateError
from app.simulate.methods import MethodSpec, parse_methods
from app.simulate.population import (
    Population,
    check_possible,
    load_population,
    with_parameters,
)
from app.simulate.worlds import WORLDS

MAX_TRIALS = 1_000_000
_USER, _ORDER, _TRIAL = 0, 1, 2  # which random stream of a seed


@dataclass(frozen=True)
class Study:
    """A validated configuration; picklable, equal ones give equal results."""

    methods: tuple[MethodSpec, ...]
    population: Population
    trials: int
    seed: int
    world: str
    scene: Scene
    preset: str

    def to_dict(self) -> dict[str, Any]:
        """As JSON values, complete enough to run the study again."""
        return {
            "methods": {m.name: settings_to_dict(m.settings) for m in self.methods},
            "preset": self.preset,
            "users": self.population.to_dict(),
            "trials": self.trials,
            "seed": self.seed,
            "world": self.world,
            "scene": json.loads(self.scene.model_dump_json()),
        }


@dataclass(frozen=True)
class Assignment:
    """Who does trial i, and what.

    Attributes:
        index: i, from 0.
        user: Number of the user, from 0.
        number: The user's trial, from 1.
        goal: Instructed object.
        model: Name of the user's model.
        parameters: The user's.
        layout_seed: Draws which object stands where.
        noise_seed: Source of the user's noise.
    """

    index: int
    user: int
    number: int
    goal: str
    model: str
    parameters: Mapping[str, float]
    layout_seed: int
    noise_seed: tuple[int, ...]


def make_study(
    *,
    methods: str,
    users: str | Path = "paper-like",
    trials: int = 300,
    seed: int = 0,
    world: str = "kinematic",
    scene: str | Path = "default",
    preset: str = "default",
    settings: Mapping[str, Any] | None = None,
    user_parameters: Mapping[str, float] | None = None,
) -> Study:
    """Validate a study.

    Args:
        methods: As `parse_methods` reads them.
        users: A shipped population's name, or a file.
        trials: Trials per method.
        seed: Of everything random.
        world: "kinematic" or "physics".
        scene: A shipped scene's name, or a file.
        preset: Where settings come from.
        settings: Of all methods.
        user_parameters: Fixed for all users that have them.

    Raises:
        SimulateError: Naming what is not possible, and what is.
        SceneError: If the scene is not.
    """
    if world not in WORLDS:
        raise SimulateError(f"world is {world!r}; valid: {', '.join(WORLDS)}")
    if not 1 <= trials <= MAX_TRIALS:
        raise SimulateError(f"trials is {trials!r}; valid: 1 to {MAX_TRIALS}")
    if not 0 <= seed < 2**53:
        raise SimulateError(f"seed is {seed!r}; valid: 0 to 2**53 - 1")
    population = load_population(users)
    if user_parameters:
        population = with_parameters(population, user_parameters)
    chosen = load_scene(scene)
    check_possible(population, chosen)
    specs = parse_methods(methods, preset, settings)
    return Study(specs, population, trials, seed, world, chosen, preset)


def assign(study: Study, index: int) -> Assignment:
    """Who does trial `index`, and what."""
    names = study.scene.object_names
    user, position = divmod(index, len(names))
    model, parameters = study.population.draw(np.random.default_rng((study.seed, user, _USER)))
    order = np.random.default_rng((study.seed, user, _ORDER)).permutation(len(names))
    rng = np.random.default_rng((study.seed, index, _TRIAL))
    return Assignment(
        index=index,
        user=user,
        number=position + 1,
        goal=names[int(order[position])],
        model=model,
        parameters=parameters,
        layout_seed=int(rng.integers(2**31)),
        noise_seed=(study.seed, index, _TRIAL, 1),
    )
