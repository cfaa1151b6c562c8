"""Simulated users at the sticks of the live page, until a visitor takes over.

`main` is what a worker of `hindsight run --attract` runs: a session with an `Attract` as driver.
"""

import random
import socket

import numpy as np

from app.core import UserInput
from app.session import worker
from app.session.spec import WorkerSpec
from app.session.trial import Trial
from app.simulate.models import MODELS, Action, Sight, User
from app.simulate.models.base import DECISION_TICKS, REST
from app.simulate.population import load_population

REST_AFTER_S = 2.0
"""How long a finished trial stays in the picture before the next one [s]."""


def main(spec: WorkerSpec, sock: socket.socket) -> None:
    """Run one session that simulated users drive until a visitor does.

    Args:
        spec: What to run; its seed, where it has one, is the users', too.
        sock: This end of the socket pair to the web process.
    """
    seed = spec.options.get("seed")
    users = random.SystemRandom().randrange(2**31) if seed is None else seed
    worker.main(spec, sock, Attract(seed=users))


class Attract:
    """Owns one simulated user after another; every trial gets a new one."""

    def __init__(self, users: str = "paper-like", seed: int = 0) -> None:
        """Choose where the users come from.

        Args:
            users: A shipped population's name, or a file.
            seed: Of users and their noise.

        Raises:
            SimulateError: If there is no such population.
        """
        self._population = load_population(users)
        self._rng = np.random.default_rng(seed)
        self._trial: Trial | None = None
        self._user: User | None = None
        self._action = Action(REST)
        self._began = self._done_ticks = 0

    def act(self, trial: Trial) -> tuple[UserInput, bool]:
        """What the user does in the tick to come: sticks, and whether the hand is to close."""
        if trial is not self._trial or self._user is None:
            self._trial, self._action, self._done_ticks = trial, Action(REST), 0
            self._user = self._next_user(trial.goal)
            self._began = trial.tick
        if trial.phase == "done":
            self._done_ticks += 1
        if trial.phase != "running":
            return REST, False
        if (trial.tick - self._began) % DECISION_TICKS == 0:
            sight = Sight(trial.time_s, trial.world.hand_pose(), trial.goals)
            self._action = self._user.act(sight)
            return self._action.input, self._action.close
        return self._action.input, False

    def wants_next(self, trial: Trial) -> bool:
        """Whether the finished trial has been looked at for long enough."""
        return trial is self._trial and self._done_ticks * trial.dt >= REST_AFTER_S

    def _next_user(self, goal: str) -> User:
        model, parameters = self._population.draw(self._rng)
        return MODELS[model](goal, parameters, np.random.default_rng(self._rng.integers(2**63)))
