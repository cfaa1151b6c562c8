"""What a tick of the control loop costs, and what is in it.

All parts are timed in one process, in turns of a few calls each, so that a busy moment of the
machine falls on all of them alike; ratios between them mean more than the figures.
"""

import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from app.core import UserInput, assist, initial_state, make_goals, preset, warm_up
from app.core.types import Goals, Pose
from app.robot.kinematics import Kinematics
from app.robot.scene_file import load_scene
from app.robot.simulation import CONTROL_DT, STEPS_PER_TICK, Simulation
from app.session.physics_world import PhysicsWorld
from app.session.trial import Trial

ROUNDS = 150
CALLS = 10
"""Calls of one part in a row."""
RESTART_TICKS = 200

Part = tuple[Callable[[], None], Callable[[], object]]
"""What is done before some calls in a row, and the call that is timed."""


def bench_loop() -> dict[str, dict[str, Any]]:
    """Names → {median, p99, unit}: physics, ik, tick, assist_3x16, assist_3x30.

    `physics` is the bare five steps of MuJoCo in free motion, again and again; `tick` is a whole
    tick of a live session without its readers, in the same motion under policy. Its `ratio` is
    the median over ticks of its cost to that of the physics inside it.
    """
    warm_up()
    ticks = _Ticks()
    parts: dict[str, Part] = {
        "physics": _physics(),
        "ik": _ik(),
        "tick": (ticks.prepare, ticks.call),
        "assist_3x16": _assist(16),
        "assist_3x30": _assist(30),
    }
    samples: dict[str, list[float]] = {name: [] for name in parts}
    for _, call in parts.values():
        for _ in range(20):
            call()
    for _ in range(ROUNDS):
        for name, (prepare, call) in parts.items():
            prepare()
            for _ in range(CALLS):
                start = time.perf_counter()
                call()
                samples[name].append(1e6 * (time.perf_counter() - start))
    figures: dict[str, dict[str, Any]] = {}
    for name, values in samples.items():
        median, p99 = np.percentile(values, [50, 99])
        figures[name] = {"median": float(median), "p99": float(p99), "unit": "µs"}
    figures["tick"]["ratio"] = float(np.median(ticks.ratios))
    return figures


def _steering(count: int) -> UserInput:
    """A push that circles, so that the hand moves freely over the table."""
    angle = 2.0 * np.pi * count / 200.0
    axes = (0.0, 0.0, 0.4 * float(np.cos(angle)), 0.4 * float(np.sin(angle)))
    return UserInput(axes=axes, device="bench", sequence=count)


def _nothing() -> None:
    """No preparation."""


class _TimedSimulation(Simulation):
    """A simulation that adds up the time of its physics steps [s]."""

    spent = 0.0

    def _advance(self) -> None:
        """The bare physics of a tick, timed."""
        start = time.perf_counter()
        super()._advance()
        self.spent += time.perf_counter() - start


class _Ticks:
    """A trial whose hand circles in the air, begun anew before assistance brings it anywhere."""

    def __init__(self) -> None:
        scene = load_scene("default")
        self._world = PhysicsWorld(scene, simulation=_TimedSimulation(scene))
        self._settings = preset("default", method="policy")
        self.ratios: list[float] = []
        self._begin()

    def _begin(self) -> None:
        self._world.reset(None)
        self._trial = Trial(self._world, self._settings, "glass", start_delay_s=0.0)

    def prepare(self) -> None:
        """Begin anew where the next calls would leave free motion."""
        if self._trial.tick + CALLS > RESTART_TICKS:
            self._begin()

    def call(self) -> None:
        """One tick; its cost over that of the physics inside it is kept."""
        simulation = self._world.simulation
        assert isinstance(simulation, _TimedSimulation)
        simulation.spent = 0.0
        start = time.perf_counter()
        self._trial.step(_steering(self._trial.tick))
        self.ratios.append((time.perf_counter() - start) / simulation.spent)


def _physics() -> Part:
    """The physics of the same motion alone, through the controls that the ticks gave."""
    world = PhysicsWorld(load_scene("default"))
    simulation = world.simulation
    start = simulation.get_state()
    trial = Trial(world, preset("default", method="policy"), "glass", start_delay_s=0.0)
    controls = [np.array(trial.step(_steering(k)).ctrl) for k in range(RESTART_TICKS)]
    model, data = simulation.model, simulation.data
    count = [0]

    def prepare() -> None:
        if count[0] + CALLS > len(controls) or count[0] == 0:
            simulation.set_state(start)
            count[0] = 0

    def call() -> None:
        data.ctrl[:] = controls[count[0] % len(controls)]
        count[0] += 1
        mujoco.mj_step(model, data, STEPS_PER_TICK)  # pyright: ignore[reportAttributeAccessIssue]

    return prepare, call


def _ik() -> Part:
    scene = load_scene("default")
    kinematics = Kinematics(scene)
    q = scene.start_joint_positions
    twist = np.array([0.1, 0.05, 0.02, 0.0, 0.0, 0.1])
    velocity = np.zeros(len(q))
    return _nothing, lambda: kinematics.solve(q, velocity, twist, CONTROL_DT)


def _assist(n_targets: int) -> Part:
    goals, pose = _random_goals(3, n_targets)
    settings = preset("default", method="policy")
    state = initial_state(goals, settings)
    direct = np.array([0.1, 0.02, 0.0, 0.0, 0.0, 0.0])
    return _nothing, lambda: assist(settings, goals, state, pose, direct, CONTROL_DT)


def _random_goals(n_goals: int, n_targets: int) -> tuple[Goals, Pose]:
    rng = np.random.default_rng(0)
    targets = {
        f"goal{i}": (
            rng.normal([0.6, 0.3 * (i - 1), 0.1], 0.03, (n_targets, 3)),
            rng.normal(size=(n_targets, 4)),
        )
        for i in range(n_goals)
    }
    return make_goals(targets), Pose(np.array([0.4, 0.0, 0.3]), np.array([1.0, 0.0, 0.0, 0.0]))
