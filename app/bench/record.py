"""What recording costs the control loop: time spent in `write`, and ticks delayed by the thread.

A loop of the real period writes records of real size into a real file. Each tick measures the call
itself, and how long a fixed piece of work beside it takes: what the writer's thread takes from the
interpreter shows there, compared with the same loop without a recorder.
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from app.recording.schema import StepRecord, TrialHeader, TrialSummary
from app.recording.writer import TrialWriter

PERIOD_S = 0.01
N_STEPS = 600
N_WORK = 20_000
"""Additions in the tick's own work: some milliseconds, about what a tick of the robot takes."""

N_PARTS = 4
"""The loop runs by turns without and with a recorder, so that a machine that slows down for a
while slows both."""

Seconds = npt.NDArray[np.float64]

_GOALS = ["glass", "cup", "bowl"]
_JOINTS = [f"joint{i}" for i in range(1, 8)]


def bench_record(n_steps: int = N_STEPS) -> dict[str, dict[str, Any]]:
    """Cost of recording a step to the loop.

    Returns:
        "record": the `write` call [ms]; "record_step": the same [µs]; "record_tick": how much
        longer the tick's other work takes than without a recorder [ms]; each as
        {"median", "p99", "unit"}.
    """
    parts = [_run_part(n_steps // N_PARTS) for _ in range(N_PARTS)]
    alone_s, write_s, beside_s = (np.concatenate(part) for part in zip(*parts, strict=True))
    extra_s = np.quantile(beside_s, (0.5, 0.99)) - np.quantile(alone_s, (0.5, 0.99))
    return {
        "record": _figure(write_s * 1e3, "ms"),
        "record_step": _figure(write_s * 1e6, "µs"),
        "record_tick": {
            "median": float(1e3 * extra_s[0]),
            "p99": float(1e3 * extra_s[1]),
            "unit": "ms",
        },
    }


def _run_part(n_steps: int) -> tuple[Seconds, Seconds, Seconds]:
    """Work alone; `write`, and work beside it: their durations [s], shape (n_steps,) each."""
    _, alone_s = _run_loop(lambda record: None, n_steps)
    with tempfile.TemporaryDirectory() as folder:
        writer = TrialWriter(Path(folder), make_header())
        write_s, beside_s = _run_loop(writer.write, n_steps)
        path = writer.close(make_summary(n_steps))
        writer.join()
        if path is None:
            raise OSError(writer.error)
    return alone_s, write_s, beside_s


def _run_loop(write: Callable[[StepRecord], None], n_steps: int) -> tuple[Seconds, Seconds]:
    """Tick n_steps times; durations of `write` and of the work beside it [s], shape (n_steps,)."""
    steps = [make_step(number) for number in range(n_steps)]
    write_s, work_s = np.empty(n_steps), np.empty(n_steps)
    next_tick = time.monotonic()
    for number, step in enumerate(steps):
        before = time.perf_counter()
        write(step)
        between = time.perf_counter()
        sum(i for i in range(N_WORK))
        work_s[number] = time.perf_counter() - between
        write_s[number] = between - before
        next_tick += PERIOD_S
        time.sleep(max(0.0, next_tick - time.monotonic()))
    return write_s, work_s


def _figure(values: Seconds, unit: str) -> dict[str, Any]:
    median, p99 = np.quantile(values, (0.5, 0.99))
    return {"median": float(median), "p99": float(p99), "unit": unit}


def make_header() -> TrialHeader:
    """A header of the usual size."""
    return TrialHeader(
        study="bench",
        participant="bench",
        session="bench",
        trial=1,
        instructed_goal=_GOALS[0],
        method="policy",
        seed=0,
        scene="default",
        scene_json="{}",
        config_json="{}",
        config_hash="",
        model_hash="",
        versions_json="{}",
        started_wall_s=time.time(),
        control_dt_s=PERIOD_S,
        physics_dt_s=0.002,
        goal_names=_GOALS,
        object_names=_GOALS,
        joint_names=_JOINTS,
        target_offsets=[0, 1, 2, 3],
        target_positions_m=[0.0] * 9,
        target_quaternions=[1.0, 0.0, 0.0, 0.0] * 3,
        start_state=[0.0] * 60,
    )


def make_step(number: int) -> StepRecord:
    """A record of the usual size, whose numbers fill all 53 bits as measured ones do."""
    rng = np.random.default_rng(number)

    def numbers(count: int) -> list[float]:
        return rng.normal(size=count).tolist()

    return StepRecord(
        step=number,
        time_s=number * PERIOD_S,
        monotonic_s=time.monotonic(),
        wall_s=time.time(),
        phase="running",
        outcome="running",
        sequence=number,
        client_time_ms=number * 10.0,
        device="gamepad",
        axes=numbers(4),
        buttons=0,
        mode="translate",
        dead_zone=0.1,
        view_yaw_rad=0.3,
        input_norm=0.5,
        input_s=number * 0.005,
        method="policy",
        enabled=True,
        settings_id=0,
        direct_twist=numbers(6),
        assistance_twist=numbers(6),
        known_goal_assistance_twist=numbers(6),
        executed_twist=numbers(6),
        belief=rng.dirichlet(np.ones(3)).tolist(),
        values=numbers(3),
        q_values=numbers(3),
        best_targets=[0, 1, 2],
        hand_position_m=numbers(3),
        hand_quaternion=numbers(4),
        joint_positions_rad=numbers(7),
        joint_velocities_rad_s=numbers(7),
        finger_positions_m=numbers(2),
        ctrl=numbers(8),
        object_poses=numbers(21),
        lateness_s=0.0,
        round_trip_ms=20.0,
    )


def make_summary(steps: int) -> TrialSummary:
    """How the bench's trial ended."""
    return TrialSummary(
        outcome="aborted",
        duration_s=steps * PERIOD_S,
        input_s=0.0,
        inferred_goal=_GOALS[0],
        steps=steps,
        late_steps=0,
        ended_wall_s=time.time(),
    )
