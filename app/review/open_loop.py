"""What other settings would have done on the logged states: the trial itself stays as it was.

The assistance is run anew over the logged poses, objects and inputs. With the settings of the log
it gives the log's own numbers, to the last bit; so every difference is the settings' doing.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from app.core import (
    AssistanceSettings,
    Pose,
    assist,
    compute_command,
    initial_state,
    known_goal_twist,
    settings_from_dict,
)
from app.core.types import Array
from app.review.jobs import Progress, Result
from app.review.logged import Driver, changed_settings, rebuild_world
from app.review.opening import open_trial
from app.review.packing import MEDIA_TYPE, pack, window
from app.review.replay import Replay
from app.session.worlds import GoalTracker

PROBE_TICKS = 100
"""Running ticks over which the way goals were tracked is found out."""
STILL = np.zeros(6)


@dataclass(frozen=True, slots=True)
class Alternative:
    """What would have been, per step; zeros outside the running phase.

    Attributes:
        direct: D(u) [m/s, rad/s], (n_steps, 6).
        assistance: What the method adds, (n_steps, 6).
        known: The same had the goal been known, (n_steps, 6).
        executed: After all limits, (n_steps, 6).
        belief: b(g), (n_steps, n_goals).
    """

    direct: Array
    assistance: Array
    known: Array
    executed: Array
    belief: Array


def open_loop(
    replay: Replay,
    changes: Mapping[str, Any],
    progress: Progress = lambda share: None,
    n_steps: int | None = None,
    *,
    every_tick: bool | None = None,
) -> Alternative:
    """Run the assistance along a trial with some settings changed.

    Args:
        replay: The trial.
        changes: Settings by name; none repeats the log.
        progress: Told how far it is.
        n_steps: Only the first steps; None: all.
        every_tick: Whether the trial looked at its goals in every tick (live sessions draw them)
            or in running ones only; None: found out. Goals follow trembling objects in steps, so
            this decides the last bits.

    Raises:
        ReviewError: If a change is not valid.
        CoreError: If this program does not know a setting of the log.
    """
    if every_tick is None:
        every_tick = looks_every_tick(replay)
    steps, driver = replay.log.steps, Driver(replay)
    n = replay.n_steps if n_steps is None else min(n_steps, replay.n_steps)
    n_goals = len(replay.header.goal_names)
    result = Alternative(*(np.zeros((n, 6)) for _ in range(4)), belief=np.zeros((n, n_goals)))
    versions = {
        number: changed_settings(settings, changes)
        for number, settings in replay.settings_by_id.items()
    }
    world = rebuild_world(replay)
    pose, poses = world.hand_pose(), np.array(world.snapshot().object_poses).reshape(-1, 7)
    tracker = GoalTracker(replay.scene)
    tracker.targets = replay.targets  # as the log has them, whatever this program would find
    settings = versions[min(versions)]
    goals = tracker.goals(poses)
    state = initial_state(goals, settings)
    _, first = assist(settings, goals, state, pose, STILL, replay.header.control_dt_s)
    belief = first.belief
    true_goal = replay.header.goal_names.index(replay.header.instructed_goal)
    for step in range(n):
        settings = versions.get(int(steps["settings_id"][step]), settings)
        direct = compute_command(replay.user_input(step), settings)
        result.direct[step] = direct
        if every_tick:
            goals = tracker.goals(poses)
        if steps["phase"][step] == "running":
            goals = tracker.goals(poses)
            stopped = bool(driver.stopped[step])
            used = _directly(settings) if stopped else settings
            given = STILL if stopped else direct
            state, found = assist(used, goals, state, pose, given, replay.header.control_dt_s)
            belief = found.belief
            result.assistance[step], result.executed[step] = found.assistance, found.twist
            if settings.enabled:
                known = known_goal_twist(settings, goals, state, pose, given, true_goal)
                result.known[step] = known - given
        result.belief[step] = belief
        pose = Pose(steps["hand_position_m"][step], steps["hand_quaternion"][step])
        poses = replay.object_poses(step)
        if step % 500 == 0:
            progress(step / n)
    return result


def looks_every_tick(replay: Replay) -> bool:
    """Whether the log's numbers follow from goals looked at in every tick."""
    running = np.flatnonzero(replay.log.steps["phase"] == "running")
    if not len(running):
        return False
    n = int(running[min(PROBE_TICKS, len(running)) - 1]) + 1
    logged = replay.log.steps["executed_twist"][:n]
    for every_tick in (False, True):
        tried = open_loop(replay, {}, n_steps=n, every_tick=every_tick)
        if np.array_equal(tried.executed[running[running < n]], logged[running[running < n]]):
            return every_tick
    return True


def repeats(replay: Replay, alternative: Alternative) -> bool:
    """Whether an alternative without changes is the log itself, to the last bit."""
    steps, running = replay.log.steps, replay.log.steps["phase"] == "running"
    return (
        np.array_equal(alternative.executed[running], steps["executed_twist"][running])
        and np.array_equal(alternative.assistance[running], steps["assistance_twist"][running])
        and np.array_equal(alternative.belief[running], steps["belief"][running])
    )


def open_loop_job(path: str, changes: dict[str, Any], progress: Progress) -> Result:
    """The curves of an alternative, named as those of the trial; runs as a job."""
    replay = Replay(open_trial(Path(path), lambda share: progress(0.5 * share)))
    found = open_loop(replay, changes, lambda share: progress(0.5 + 0.5 * share))
    meta = {"loop": "open", "changes": changes}
    return Result(pack_alternative(replay, found, meta), MEDIA_TYPE)


def pack_alternative(replay: Replay, found: Alternative, meta: Mapping[str, Any]) -> bytes:
    """An alternative for the page, thinned like the trial's own curves."""
    first, end, stride = window(len(found.direct), 0, -1)
    rows = np.unique(np.append(np.arange(first, end, stride), end - 1))
    arrays: dict[str, Any] = {"seconds": replay.seconds[rows], "step": rows}
    for index in range(6):
        arrays[f"input.{index}"] = found.direct[rows, index]
        arrays[f"assistance.{index}"] = found.assistance[rows, index]
        arrays[f"known.{index}"] = found.known[rows, index]
        arrays[f"executed.{index}"] = found.executed[rows, index]
    arrays["dot"] = np.einsum("ij,ij->i", found.direct[rows, :3], found.assistance[rows, :3])
    for goal, name in enumerate(replay.header.goal_names):
        arrays[f"belief.{name}"] = found.belief[rows, goal]
    return pack(meta, arrays)


def _directly(settings: AssistanceSettings) -> AssistanceSettings:
    return settings_from_dict({"method": "direct"}, settings)
