"""What would have happened: the trial re-simulated, with other settings from a moment on.

The person's logged inputs are replayed as they were, which is the catch: people would have reacted.
Up to the moment the re-simulation is the log itself, bit for bit, where the versions are equal; it
says from which step on it is not.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from app.core import settings_to_dict
from app.recording.columns import to_columns
from app.recording.schema import StepRecord
from app.review.jobs import Progress, Result
from app.review.logged import Driver, changed_settings, rebuild_world
from app.review.open_loop import Alternative, looks_every_tick, pack_alternative
from app.review.opening import open_trial
from app.review.packing import MEDIA_TYPE
from app.review.replay import Replay
from app.session.commands import Command, CommandError
from app.session.trial import Trial

CAVEAT = "Re-simulated with the inputs as they were given; a person would have reacted."
PATH_POINTS = 300
"""Points of the hand's path that the page draws in 3-D."""


@dataclass(frozen=True, slots=True)
class Rerun:
    """A re-simulated trial.

    Attributes:
        records: Its steps.
        parts_at: First step before the moment that is not the log's own; None: there is none.
        refused: Logged commands that were not possible any more, with the reason.
        outcome: How it ended; "running" where the inputs ended first.
        grasped_object: What was lifted; empty: nothing.
    """

    records: list[StepRecord]
    parts_at: int | None
    refused: list[str]
    outcome: str
    grasped_object: str


def closed_loop(
    replay: Replay,
    changes: Mapping[str, Any],
    first: int,
    progress: Progress = lambda share: None,
    n_steps: int | None = None,
) -> Rerun:
    """Step a trial through its logged inputs, with some settings changed from a step on.

    Args:
        replay: The trial.
        changes: Settings by name; none repeats the log.
        first: The step at which they change.
        progress: Told how far it is.
        n_steps: Only the first steps; None: all.

    Raises:
        ReviewError: If the trial cannot be set up as it was, or a change is not valid.
    """
    driver, config = Driver(replay), replay.config
    every_tick = looks_every_tick(replay)
    trial = _trial(replay, config)
    records: list[StepRecord] = []
    refused: list[str] = []
    parts_at: int | None = None
    first = replay.clamp(first)
    for step in range(replay.n_steps if n_steps is None else min(n_steps, replay.n_steps)):
        commands = driver.commands(step)
        if step >= first and changes:
            commands = [_overridden(command, changes) for command in commands]
            if step == first:
                changed = changed_settings(trial.settings, changes)
                commands.append(Command("settings", {"changes": settings_to_dict(changed)}))
        for command in commands:
            try:
                trial.command(command)
            except CommandError as error:
                refused.append(f"at {replay.seconds[step]:.2f} s: {error}")
        record = trial.step(replay.user_input(step), stamps=driver.stamps(step))
        records.append(record)
        if step < first and parts_at is None and not _same(record, replay.record(step)):
            parts_at = step
        if every_tick:
            _ = trial.goals
        trial.take_events()
        if step % 100 == 0:
            progress(step / replay.n_steps)
    return Rerun(records, parts_at, refused, trial.outcome, trial.grasped_object)


def _trial(replay: Replay, config: Mapping[str, Any]) -> Trial:
    """The trial before its first tick."""
    header, rule = replay.header, config.get("start", "auto")
    started = [event.step for event in replay.log.events if event.name == "start"]
    # A trial that never started was held to its end.
    delay_ticks = started[0] if started else replay.n_steps + 1
    return Trial(
        rebuild_world(replay),
        replay.settings_by_id[min(replay.settings_by_id)],
        header.instructed_goal,
        seed=header.seed,
        start=rule,
        start_delay_s=delay_ticks * header.control_dt_s,
        timeout_s=config.get("timeout_s"),
        hold_on_loss=bool(config.get("hold_on_loss")),
        with_known_goal=_knew_goal(replay),
    )


def _knew_goal(replay: Replay) -> bool:
    """Simulations leave the assistance for a known goal out: a log without any says so."""
    return bool(replay.log.steps["known_goal_assistance_twist"].any()) or replay.physical


def _overridden(command: Command, changes: Mapping[str, Any]) -> Command:
    """A logged change of settings does not undo what is asked about."""
    if command.name != "settings":
        return command
    return Command("settings", {"changes": {**command.args["changes"], **changes}})


def _same(record: StepRecord, logged: StepRecord) -> bool:
    """Whether a re-simulated step is the logged one in all that the simulation decides."""
    return (
        record.joint_positions_rad == logged.joint_positions_rad
        and record.hand_position_m == logged.hand_position_m
        and record.object_poses == logged.object_poses
        and record.executed_twist == logged.executed_twist
        and record.belief == logged.belief
    )


def closed_loop_job(path: str, changes: dict[str, Any], first: int, progress: Progress) -> Result:
    """The curves of a re-simulated trial and the hand's path; runs as a job."""
    replay = Replay(open_trial(Path(path), lambda share: progress(0.3 * share)))
    rerun = closed_loop(replay, changes, first, lambda share: progress(0.3 + 0.7 * share))
    columns = to_columns(rerun.records)
    found = Alternative(
        direct=columns["direct_twist"],
        assistance=columns["assistance_twist"],
        known=columns["known_goal_assistance_twist"],
        executed=columns["executed_twist"],
        belief=columns["belief"],
    )
    hand = columns["hand_position_m"][replay.clamp(first) :]
    rows = np.linspace(0, len(hand) - 1, min(PATH_POINTS, len(hand))).astype(int)
    meta = {
        "loop": "closed",
        "changes": changes,
        "first": replay.clamp(first),
        "caveat": CAVEAT,
        "parts_at": rerun.parts_at,
        "refused": rerun.refused,
        "outcome": rerun.outcome,
        "grasped_object": rerun.grasped_object,
        "path": np.round(hand[rows], 4).ravel().tolist(),
        "versions": msgspec.json.decode(replay.header.versions_json),
    }
    return Result(pack_alternative(replay, found, meta), MEDIA_TYPE)
