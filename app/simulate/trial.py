"""One simulated trial: a user drives `app.session.trial.Trial`, and it is measured."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from app.core.measures import calibration_counts, compute_measures
from app.session.commands import Command
from app.session.tick import Tick
from app.session.trial import CONTROL_DT_S, Trial
from app.session.worlds import World
from app.simulate.methods import MethodSpec
from app.simulate.models import MODELS, Action, Sight
from app.simulate.models.base import DECISION_TICKS, REST
from app.simulate.plan import Assignment, Study, assign
from app.simulate.worlds import HidingWorld, make_world

Row = dict[str, Any]
"""One line of the trials table (docs/data.md), and `calibration`, see `run_trial`."""

STUDY_NAME = "simulated"
_GRASP = (Command("grasp"),)
CALIBRATION_BINS = 10
_COLUMNS = ("phase", "input_norm", *(f"{name}_twist" for name in Tick._fields[2:5]), "belief")


class Runner:
    """Owns the world that the trials of one process are stepped in."""

    def __init__(self, study: Study) -> None:
        """Make the world once; every trial resets it."""
        self._study = study
        self._world = make_world(study.world, study.scene)

    def run(self, index: int) -> list[Row]:
        """Trial `index` under every method: one row each, in the study's order of methods."""
        return list(self._rows(assign(self._study, index)))

    def _rows(self, assignment: Assignment) -> Iterator[Row]:
        for position, method in enumerate(self._study.methods):
            measured = run_trial(self._world, self._study.preset, method, assignment)
            yield _keys(self._study, assignment, method, position) | measured


def run_trial(world: World, preset: str, method: MethodSpec, assignment: Assignment) -> Row:
    """Run and measure one trial.

    Returns:
        The measured columns of the trials table; and under "calibration" the counts of
        `calibration_counts`, flat (3 × 10), or None where the goal is not modelled.
    """
    world.reset(assignment.layout_seed)
    model = MODELS[assignment.model]
    rng = np.random.default_rng(assignment.noise_seed)
    user = model(assignment.goal, assignment.parameters, rng)
    seen: Any = world if model.MODELLED else HidingWorld(world, assignment.goal)
    trial = Trial(
        seen,
        method.settings,
        assignment.goal,
        seed=assignment.layout_seed,
        preset=preset,
        start_delay_s=0.0,
        with_known_goal=False,
    )
    ticks: list[Tick] = []
    action = Action(REST)
    while trial.phase != "done":
        commands: tuple[Command, ...] = ()
        if trial.tick % DECISION_TICKS == 0:
            action = user.act(Sight(trial.time_s, world.hand_pose(), world.goals()))
            if action.close and trial.phase == "running":
                commands = _GRASP
        ticks.append(trial.advance(action.input, commands))
    return _measure(trial, ticks, model.MODELLED)


def _measure(trial: Trial, ticks: list[Tick], modelled: bool) -> Row:
    columns = dict(zip(_COLUMNS, map(np.asarray, zip(*ticks, strict=True)), strict=True))
    names = trial.goals.names
    goal = names.index(trial.goal) if modelled else None
    measures = compute_measures(columns, true_goal=goal, dt=CONTROL_DT_S)
    running = columns["phase"] == "running"
    belief = columns["belief"]
    counts = None
    if goal is not None and running.any():
        counts = np.concatenate(calibration_counts(belief[running], goal, CALIBRATION_BINS))
    return {
        "outcome": trial.outcome,
        "success": trial.outcome == "grasped",
        "counted": trial.outcome == "grasped",
        **{k: None if np.isnan(v) else v for k, v in measures.to_dict().items()},
        "inferred_goal": names[int(belief[-1].argmax())],
        "calibration": None if counts is None else counts.tolist(),
    }


def _keys(study: Study, assignment: Assignment, method: MethodSpec, position: int) -> Row:
    factors = {f"user.{name}": value for name, value in assignment.parameters.items()}
    return {
        "study": STUDY_NAME,
        "participant_id": f"user-{assignment.user + 1:04d}",
        "session": 1,
        "trial": assignment.number,
        "attempt": 1,
        "part": "recorded",
        "method": method.name,
        "shown_as": method.name,
        "method_position": position + 1,
        "object": assignment.goal,
        "cell": "",
        "seed": assignment.layout_seed,
        "scene": study.scene.name,
        "world": study.world,
        "round_trip_ms": None,
        "late_share": 0.0,
        "blurs": 0,
        "drops": 0,
        "device": "simulated",
        "user_model": assignment.model,
        "options": json.dumps({**method.differs, **factors}, sort_keys=True),
        "file": "",
    }
