"""Random and scripted scenes for the core's tests."""

import numpy as np
from hypothesis import strategies as st

from app.core import Goals, Pose, make_goals
from app.core.types import Array


def random_quaternions(rng: np.random.Generator, n: int) -> Array:
    """Return n uniformly random unit quaternions, shape (n, 4)."""
    q = rng.normal(size=(n, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def random_goals(rng: np.random.Generator, n_goals: int, n_targets: int) -> Goals:
    """Return goals 0.2–0.6 m away, their targets within a few centimetres of each other."""
    goals = {}
    for index in range(n_goals):
        centre = rng.uniform([0.2, -0.3, 0.0], [0.6, 0.3, 0.2])
        positions = centre + rng.normal(scale=0.03, size=(n_targets, 3))
        goals[f"goal-{index}"] = (positions, random_quaternions(rng, n_targets))
    return make_goals(goals)


def random_pose(rng: np.random.Generator) -> Pose:
    """Return a pose of the hand over the table."""
    position = rng.uniform([0.0, -0.3, 0.0], [0.6, 0.3, 0.4])
    return Pose(position, random_quaternions(rng, 1)[0])


def random_twist(rng: np.random.Generator, rotating: bool = True) -> Array:
    """Return a twist of up to 0.2 m/s and 0.4 rad/s per axis."""
    twist = rng.uniform(-1.0, 1.0, 6) * [0.2, 0.2, 0.2, 0.4, 0.4, 0.4]
    if not rotating:
        twist[3:] = 0.0
    return twist


def three_goals_in_line() -> Goals:
    """Return goals at y = −0.2, 0, 0.2 with one target each, oriented as the hand is."""
    return make_goals(
        {
            name: (np.array([[0.3, y, 0.1]]), np.array([[1.0, 0.0, 0.0, 0.0]]))
            for name, y in (("right", -0.2), ("middle", 0.0), ("left", 0.2))
        }
    )


IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])

seeds = st.integers(min_value=0, max_value=2**32 - 1)
"""Seeds of a random scene: hypothesis searches over scenes by searching over seeds."""
