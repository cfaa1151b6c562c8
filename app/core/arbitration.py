"""How much of the robot's action `blend` takes: c in [0, 1] from confidence in the goal."""

from collections.abc import Callable

import numpy as np

from app.core.situation import Situation


def distance(situation: Situation, goal: int) -> float:
    """Return c = max(0, 1 − d/D), d to the goal's nearest target: the paper's (Sec. VI)."""
    d = float(situation.distances[goal])
    return max(0.0, 1.0 - d / situation.settings.arbitration_distance)


def distance_gate(situation: Situation, goal: int) -> float:
    """Return 1 within the gate's distance of the goal's nearest target, else 0."""
    return 1.0 if situation.distances[goal] < situation.settings.gate_distance else 0.0


def probability_gate(situation: Situation, goal: int) -> float:
    """Return 1 where p₁ − p₂ exceeds the gate, else 0: the authors' released default."""
    others = np.delete(situation.belief, goal)
    second = float(others.max()) if len(others) else 0.0
    return 1.0 if situation.belief[goal] - second > situation.settings.gate_probability else 0.0


ARBITRATIONS: dict[str, Callable[[Situation, int], float]] = {
    "distance": distance,
    "distance-gate": distance_gate,
    "probability-gate": probability_gate,
}
"""Arbitration → (situation, most probable goal) → c."""
