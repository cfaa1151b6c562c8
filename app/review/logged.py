"""What drove a logged trial: the person's input, commands and losses of every tick, in order."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from app.core import AssistanceSettings, CoreError, settings_from_dict
from app.recording.schema import TrialEvent
from app.review.errors import ReviewError
from app.review.replay import Replay
from app.session.assistant import method_changes
from app.session.commands import Command, CommandError
from app.session.kinematic_world import KinematicWorld
from app.session.physics_world import PhysicsWorld
from app.session.stamps import Stamps

World = PhysicsWorld | KinematicWorld


def changed_settings(base: AssistanceSettings, changes: Mapping[str, Any]) -> AssistanceSettings:
    """Settings with some changed by name; another method brings its defaults, as on the live page.

    Raises:
        ReviewError: Naming the setting, its value and what is valid.
    """
    wanted = dict(changes)
    method = wanted.get("method", base.method)
    try:
        if method != base.method:
            wanted = {**method_changes(base, str(method), "default"), **wanted}
        return settings_from_dict(wanted, base)
    except (CoreError, CommandError) as error:
        raise ReviewError(str(error)) from None


@dataclass(frozen=True)
class Driver:
    """Reads what drove the trial from its steps and events.

    Attributes:
        replay: The trial.
    """

    replay: Replay

    @cached_property
    def events(self) -> dict[int, list[TrialEvent]]:
        """Step → its events, in order."""
        found: dict[int, list[TrialEvent]] = {}
        for event in self.replay.log.events:
            found.setdefault(event.step, []).append(event)
        return found

    @cached_property
    def losses(self) -> list[str]:
        """Per step why there was no input; empty: there was."""
        reasons, reason = [], ""
        for step in range(self.replay.n_steps):
            for event in self.events.get(step, ()):
                if event.name == "input_lost":
                    reason = str(_detail(event).get("reason", "lost"))
                elif event.name == "input_back":
                    reason = ""
            reasons.append(reason)
        return reasons

    @cached_property
    def stopped(self) -> npt.NDArray[np.bool_]:
        """Per step whether the arm was told to rest: by `hold`, or by lost input, (n_steps,)."""
        steps, hold_on_loss = self.replay.log.steps, bool(self.replay.config.get("hold_on_loss"))
        result = np.zeros(self.replay.n_steps, dtype=bool)
        halted = False
        for step in range(self.replay.n_steps):
            halted = halted or any(e.name == "hold" for e in self.events.get(step, ()))
            if steps["phase"][step] == "running":
                halted = halted and steps["input_norm"][step] == 0.0
                result[step] = halted or (hold_on_loss and self.losses[step] != "")
        return result

    def commands(self, step: int) -> list[Command]:
        """The commands of a step, as the trial was given them.

        A change of method or of single settings is repeated as the settings in full that it led to.
        """
        signal = self.replay.config.get("start") == "signal"
        commands = []
        for event in self.events.get(step, ()):
            if event.name in ("grasp", "open", "hold") or (event.name == "start" and signal):
                commands.append(Command(event.name))
            elif event.name == "settings" and _detail(event).get("why") != "start of trial":
                commands.append(Command("settings", {"changes": _detail(event)["settings"]}))
        return commands

    def stamps(self, step: int) -> Stamps:
        """What the owner of the clock knew at a step."""
        steps = self.replay.log.steps
        late = [e for e in self.events.get(step, ()) if e.name == "late"]
        return Stamps(
            monotonic_s=float(steps["monotonic_s"][step]),
            wall_s=float(steps["wall_s"][step]),
            lateness_s=float(steps["lateness_s"][step]),
            round_trip_ms=float(steps["round_trip_ms"][step]),
            skipped=int(_detail(late[0]).get("skipped", 0)) if late else 0,
            loss=self.losses[step],
        )


def rebuild_world(replay: Replay) -> World:
    """The world at the trial's first state.

    Raises:
        ReviewError: If this program sets up another one from the same scene and seed.
    """
    header = replay.header
    kind = PhysicsWorld if replay.physical else KinematicWorld
    world = kind(replay.scene, header.seed)
    if not _begins_alike(world, replay):
        world.reset(None)
        if not _begins_alike(world, replay):
            raise ReviewError(
                "this program sets the trial up differently from the same scene and seed: "
                f"{_why(world, replay)}"
            )
    return world


def _begins_alike(world: World, replay: Replay) -> bool:
    if isinstance(world, PhysicsWorld):
        return world.start_state() == replay.header.start_state
    return world.snapshot().object_poses == replay.log.steps["object_poses"][0].tolist()


def _why(world: World, replay: Replay) -> str:
    made_with = msgspec.json.decode(replay.header.versions_json, type=dict[str, str])
    if world.model_hash != replay.header.model_hash:
        return (
            f"its physics model is {replay.header.model_hash[:12]}…, made by Hindsight "
            f"{made_with.get('hindsight', '?')} with mujoco {made_with.get('mujoco', '?')}; here "
            f"it is {world.model_hash[:12]}…"
        )
    return "the first state differs"


def _detail(event: TrialEvent) -> dict[str, Any]:
    return msgspec.json.decode(event.detail) if event.detail else {}
