"""`hindsight bench simulate`: how fast simulated users do their trials, and what two workers bring.

A core's rate is counted in the processor time of one process, which a busy machine disturbs less
than the clock; the gain of two workers can only be read from the clock.
"""

import time
from dataclasses import replace
from typing import Any

from app.core import warm_up
from app.simulate.plan import Study, make_study
from app.simulate.pool import run_trials
from app.simulate.trial import Runner

METHODS = "blend,policy,yielding"
KINEMATIC_TRIALS, PHYSICS_TRIALS, POOL_TRIALS = 20, 4, 120


def bench_simulate() -> dict[str, dict[str, Any]]:
    """Return kinematic trials per core and second, both worlds against real time, and the pool."""
    warm_up()
    kinematic = make_study(methods=METHODS, trials=KINEMATIC_TRIALS, seed=1)
    physics = make_study(methods=METHODS, trials=PHYSICS_TRIALS, seed=1, world="physics")
    trials_s, times = _core_rate(kinematic)
    _, physics_times = _core_rate(physics)
    gain = _pool_gain(replace(kinematic, trials=POOL_TRIALS))
    return {
        "kinematic trials": {"median": trials_s, "p99": "", "unit": "trials/s/core"},
        "kinematic speed": {"median": times, "p99": "", "unit": "× real time/core"},
        "physics speed": {"median": physics_times, "p99": "", "unit": "× real time/core"},
        "two workers": {"median": gain, "p99": "", "unit": "× one worker"},
    }


def _core_rate(study: Study) -> tuple[float, float]:
    """Trials per second of processor time, and simulated seconds per second of it."""
    runner = Runner(study)
    runner.run(0)
    started = time.process_time()
    rows = [row for index in range(study.trials) for row in runner.run(index)]
    spent = time.process_time() - started
    return len(rows) / spent, sum(row["time_s"] for row in rows) / spent


def _pool_gain(study: Study) -> float:
    """Clock time of one worker's trials over that of two, both after their start."""
    return _clock_rate(study, 2) / _clock_rate(study, 1)


def _clock_rate(study: Study, workers: int) -> float:
    """Trials per second once the first results are there: starting up is not what is measured."""
    started, counted = 0.0, 0
    for done in run_trials(study, range(study.trials), workers):
        if not started:
            started = time.perf_counter()
        else:
            counted += len(done)
    return counted / (time.perf_counter() - started)
