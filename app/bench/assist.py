"""`hindsight bench assist`: one full update of the assistance, compiled against numpy."""

import importlib
import time
from collections.abc import Callable

import numpy as np

from app.core import CoreError, Goals, initial_state, make_goals, numpy_backend, preset
from app.core.backend import Backend
from app.core.belief import Evidence
from app.core.evaluation import BELIEF, N_ROWS
from app.core.methods import METHODS
from app.core.situation import Situation

SIZES = ((3, 1), (3, 16), (3, 30), (10, 30), (30, 30), (100, 30))  # goals × targets each
ROUNDS = 100
BATCH = 100e-6  # [s] one reading takes: long for the clock, short enough not to be interrupted


def bench_assist() -> dict[str, dict[str, float]]:
    """Return {"numpy", "compiled"} → size, e.g. "3x30" → median time of one full update [µs].

    One update is V, Q, soft-min prediction, belief and the policy's twist. All sizes and both
    implementations take turns in every round of one run, so that a busy moment hits them alike.

    Raises:
        CoreError: If the kernels cannot be compiled on this machine.
    """
    backends: dict[str, Backend] = {"numpy": numpy_backend, "compiled": _compiled()}
    updates = {
        (name, f"{n}x{m}"): _make_update(backend, _random_goals(n, m))
        for n, m in SIZES
        for name, backend in backends.items()
    }
    calls = {key: _calls_per_reading(update) for key, update in updates.items()}
    times: dict[tuple[str, str], list[float]] = {key: [] for key in updates}
    for _ in range(ROUNDS):
        for key, update in updates.items():
            start = time.perf_counter()
            for _ in range(calls[key]):
                update()
            times[key].append((time.perf_counter() - start) / calls[key])
    return {
        name: {
            f"{n}x{m}": round(1e6 * float(np.median(times[name, f"{n}x{m}"])), 2) for n, m in SIZES
        }
        for name in backends
    }


def _compiled() -> Backend:
    try:
        return importlib.import_module("app.core.compiled_backend")  # type: ignore[return-value]
    except Exception as error:  # numba and LLVM fail in many ways
        raise CoreError(f"the kernels cannot be compiled here: {error}") from error


def _calls_per_reading(update: Callable[[], None]) -> int:
    durations = []
    for _ in range(10):
        start = time.perf_counter()
        update()
        durations.append(time.perf_counter() - start)
    return max(1, round(BATCH / min(durations)))


def _random_goals(n_goals: int, n_targets: int) -> Goals:
    rng = np.random.default_rng(0)
    goals = {}
    for index in range(n_goals):
        centre = rng.uniform([0.2, -0.3, 0.0], [0.6, 0.3, 0.2])
        quaternions = rng.normal(size=(n_targets, 4))
        goals[f"goal-{index}"] = (centre + rng.normal(0.0, 0.03, (n_targets, 3)), quaternions)
    return make_goals(goals)


def _make_update(backend: Backend, goals: Goals) -> Callable[[], None]:
    settings = preset("default", method="policy")
    state = initial_state(goals, settings)
    x = np.array([0.1, 0.0, 0.3, 0.5, 0.5, 0.5, 0.5, 0.1, 0.05, -0.02, 0.0, 0.0, 0.0])
    evidence = Evidence(weight=settings.beta * 0.01 / settings.look_ahead, drift=0.0, decay=1.0)
    rows, best = np.empty((N_ROWS, goals.n_goals)), np.empty(goals.n_goals, dtype=np.int64)
    gradient = np.empty(6)
    policy = METHODS["policy"]

    def update() -> None:
        backend.update(
            settings,
            goals,
            x,
            state.log_belief,
            state.log_prior,
            evidence,
            rows,
            best,
            gradient,
        )
        policy(Situation(settings, goals, x, rows[BELIEF], rows, best, gradient))

    update()
    return update
