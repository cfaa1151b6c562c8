"""One trial, tick by tick: without a clock, a socket or a viewer, and deterministic.

    ready    the arm is held at its start pose
    running  from the start signal (the arm is released) to the command that closes the hand
    closing  the hand closes where it is
    lifting  what it holds is lifted, which checks the grasp
    done     the outcome is known; the arm holds, the hand may be opened

Live sessions, simulated users, replay and tests step it alike. Whoever owns a clock stamps the
ticks; the trial itself counts them.
"""

from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from app.core import (
    AssistanceSettings,
    Goals,
    UserInput,
    settings_to_dict,
)
from app.core.types import Array
from app.recording.schema import (
    Outcome,
    Phase,
    StepRecord,
    TrialEvent,
    TrialHeader,
    TrialSummary,
)
from app.session.assistant import STILL, Assistant
from app.session.commands import Command, CommandError
from app.session.header import TrialIdentity, make_header
from app.session.spec import START_DELAY_S, StartRule
from app.session.stamps import NO_STAMPS, Stamps
from app.session.steering import Steering
from app.session.tick import Tick
from app.session.worlds import Verdict, World

CONTROL_DT_S = 0.01
"""Control period [s]: 100 ticks a second."""
_HOLDING = ("grasped", "wrong_object")
_GRASP, _OPEN = 1, 2  # bits of StepRecord.buttons


class Trial:
    """Owns the state of one trial and steps its world.

    Commands take effect at the tick they are given in; every change of method or settings is an
    event that holds the settings in full.

    Attributes:
        phase: As above, for the tick to come.
        outcome: "running" until the trial is done.
        grasped_object: What was lifted; empty: nothing.
        settings_id: Number of the last "settings" event.
    """

    def __init__(
        self,
        world: World,
        settings: AssistanceSettings,
        goal: str,
        *,
        seed: int = 0,
        identity: TrialIdentity | None = None,
        preset: str = "default",
        start: StartRule = "auto",
        start_delay_s: float = START_DELAY_S,
        timeout_s: float | None = None,
        hold_on_loss: bool = False,
        with_known_goal: bool = True,
        wall_s: float = 0.0,
    ) -> None:
        """Begin a trial in a world that was just set up.

        Args:
            world: Stands at its start; stepped by this trial alone.
            settings: What the assistance begins with.
            goal: Name of the object the user is told to grasp.
            seed: Of the layout, written to the header.
            identity: Who does which trial of what, written to the header.
            preset: Where the settings come from; under "default" a method brings its own.
            start: "auto" releases the arm after `start_delay_s`, "input" at the first push,
                "signal" at the command start.
            start_delay_s: How long "auto" holds the arm [s].
            timeout_s: Longest time from the start signal to the closing command [s]; 0: no
                limit; None: the scene's.
            hold_on_loss: Whether lost input stops the arm.
            with_known_goal: Whether each tick computes the assistance had the goal been known;
                simulations that do not read it save its cost.
            wall_s: Wall clock at the beginning, for the header.

        Raises:
            CommandError: If the goal is no object of the scene.
        """
        if goal not in world.scene.object_names:
            valid = ", ".join(world.scene.object_names)
            raise CommandError(f"target is {goal!r}; valid: {valid}")
        self.world = world
        self.goal = goal
        self.seed = seed
        self.identity = identity or TrialIdentity()
        self.dt = CONTROL_DT_S
        self.phase: Phase = "ready"
        self.outcome: Outcome = "running"
        self.grasped_object = ""
        self.settings_id = 0
        self._goal_index = world.scene.object_names.index(goal)
        self._assistant = Assistant(settings, world.goals(), world.hand_pose(), self.dt, preset)
        self._start_rule = start
        self._start_tick = round(start_delay_s / self.dt) if start == "auto" else -1
        self._timeout_s = world.scene.time_limit_s if timeout_s is None else timeout_s
        self._hold_on_loss = hold_on_loss
        self._with_known_goal = with_known_goal
        self._tick = 0
        self._running_ticks = 0
        self._input_s = 0.0
        self._late = 0
        self._buttons = 0
        self._halted = False
        self._steering = Steering()
        self._stamps = Stamps(wall_s=wall_s)
        self._events: list[TrialEvent] = []
        self._header = make_header(self, wall_s)
        world.begin(goal)
        self._note_settings("start of trial")

    def step(
        self,
        user_input: UserInput,
        commands: Sequence[Command] = (),
        stamps: Stamps = NO_STAMPS,
    ) -> StepRecord:
        """One control tick of 0.01 s.

        Args:
            user_input: The newest input; zero where it was lost.
            commands: Carried out before the tick, in order.
            stamps: What the owner of the clock knows.

        Raises:
            CommandError: If a command is not possible; the tick has not begun.
        """
        tick = self._move(user_input, commands, stamps)
        record = self._record(user_input, tick)
        self._conclude()
        return record

    def advance(self, user_input: UserInput, commands: Sequence[Command] = ()) -> Tick:
        """The same tick as `step`, without clock and record: for those who do very many."""
        tick = self._move(user_input, commands, NO_STAMPS)
        self._conclude()
        return tick

    def _move(self, user_input: UserInput, commands: Sequence[Command], stamps: Stamps) -> Tick:
        """Commands, user, method and world, in this order."""
        self._watch(stamps)
        for command in commands:
            self.command(command)
        direct, pushed = self._steering.command(user_input, self.settings)
        if self.phase == "ready":
            self._maybe_release(pushed)
        executed = self.world.step(self._asked(direct, pushed))
        step = self._assistant.step
        assistance = step.assistance if self.phase == "running" else STILL
        return Tick(self.phase, pushed, direct, assistance, executed, step.belief)

    def _conclude(self) -> None:
        """Judge the tick and count it."""
        self._judge()
        self._tick += 1
        self._buttons = 0

    def _maybe_release(self, pushed: float) -> None:
        if self._start_rule == "input" and pushed > 0.0:
            self._start_tick = self._tick
        if self._tick == self._start_tick:
            self.phase = "running"
            self.note("start")

    def _asked(self, direct: Array, pushed: float) -> Array:
        """What user and method ask for in this tick; only a running trial moves the arm."""
        if self.phase != "running":
            return STILL
        self._running_ticks += 1
        self._input_s += pushed * self.dt
        self._halted = self._halted and pushed == 0.0
        stopped = self._halted or (self._hold_on_loss and self._stamps.loss != "")
        return self._assistant.update(
            self.world.goals(), self.world.hand_pose(), direct, stopped=stopped
        )

    def _judge(self) -> None:
        """Advance closing and lifting, and end the trial where its outcome is known."""
        if self.phase in ("ready", "done"):
            return
        verdict = self.world.judge()
        if verdict.hand in ("closing", "lifting"):
            self.phase = verdict.hand
        if verdict.outcome != "running":
            self._end(verdict)
        elif self.phase == "running" and 0.0 < self._timeout_s <= self.duration_s + 1e-9:
            self._end(Verdict("timeout", verdict.hand, ""))

    def _end(self, verdict: Verdict) -> None:
        self.phase = "done"
        self.outcome = verdict.outcome
        self.grasped_object = verdict.object if verdict.outcome in _HOLDING else ""
        self.note("outcome", outcome=self.outcome, grasped_object=self.grasped_object)

    # commands

    def command(self, command: Command) -> None:
        """Carry out one command of a trial: start, grasp, open, hold, method, assist, settings.

        Raises:
            CommandError: If it is not possible now, or a value is not valid.
        """
        args = command.args
        if command.name == "start":
            self._start()
        elif command.name == "grasp":
            self._grasp()
        elif command.name == "open":
            self._open()
        elif command.name == "hold":
            self._halted = True
            self.note("hold")
        elif command.name == "method":
            self._assistant.change_method(args["method"])
            self.note("method", method=args["method"])
            self._note_settings("method")
        elif command.name == "assist":
            self._assistant.change({"enabled": args["enabled"]})
            self.note("assist", enabled=args["enabled"])
            self._note_settings("assist")
        elif command.name == "settings":
            self._assistant.change(args["changes"])
            self._note_settings("settings")
        else:
            valid = "start, grasp, open, hold, method, assist, settings"
            raise CommandError(f"{command.name!r} is no command of a trial; valid: {valid}")

    def _start(self) -> None:
        if self.phase != "ready":
            raise CommandError(f"start: the trial is {self.phase}; valid: while it is ready")
        self._start_tick = self._tick

    def _grasp(self) -> None:
        if self.phase != "running":
            raise CommandError(f"grasp: the trial is {self.phase}; valid: while it is running")
        self.phase = "closing"
        self.world.close_hand()
        self._buttons |= _GRASP
        self.note("grasp")

    def _open(self) -> None:
        if self.phase != "done":
            raise CommandError(f"open: the trial is {self.phase}; valid: when it is done")
        self.world.open_hand()
        self._buttons |= _OPEN
        self.note("open")

    # how it stands

    @property
    def settings(self) -> AssistanceSettings:
        """As they are now."""
        return self._assistant.settings

    @property
    def goals(self) -> Goals:
        """The targets in the world frame, where the objects are now."""
        return self.world.goals()

    @property
    def tick(self) -> int:
        """Number of the tick to come."""
        return self._tick

    @property
    def time_s(self) -> float:
        """Since the start signal [s]; negative before it, 0 while it is not known."""
        return (self._tick - self._start_tick) * self.dt if self._start_tick >= 0 else 0.0

    @property
    def duration_s(self) -> float:
        """From the start signal to the closing command, or until now [s]."""
        return self._running_ticks * self.dt

    def header(self) -> TrialHeader:
        """Everything that was fixed before the first tick."""
        return self._header

    def rules(self) -> dict[str, Any]:
        """The rules of this trial, for the header's configuration."""
        return {
            "start": self._start_rule,
            "timeout_s": self._timeout_s,
            "hold_on_loss": self._hold_on_loss,
        }

    def summary(self, wall_s: float = 0.0) -> TrialSummary:
        """How the trial stands; of one that is not done: aborted."""
        return TrialSummary(
            outcome=self.outcome if self.phase == "done" else "aborted",
            duration_s=self.duration_s,
            input_s=self._input_s,
            inferred_goal=self.world.scene.object_names[int(np.argmax(self._assistant.belief))],
            grasped_object=self.grasped_object,
            steps=self._tick,
            late_steps=self._late,
            ended_wall_s=wall_s,
        )

    def counterfactuals(self) -> dict[str, Array]:
        """What each method would have done in the last running tick: method → twist (6,)."""
        return self._assistant.counterfactuals()

    # what is written down

    def note(self, name: str, **detail: Any) -> None:
        """Record an event at this tick."""
        event = TrialEvent(
            time_s=self.time_s,
            wall_s=self._stamps.wall_s,
            step=self._tick,
            name=name,
            detail=msgspec.json.encode(detail).decode() if detail else "",
        )
        self._events.append(event)

    def take_events(self) -> list[TrialEvent]:
        """Events since the last call."""
        events, self._events = self._events, []
        return events

    def _watch(self, stamps: Stamps) -> None:
        """Events for input that is lost or back, and for ticks that were lost."""
        before, self._stamps = self._stamps.loss, stamps
        if stamps.loss != before:
            self.note("input_lost" if stamps.loss else "input_back", reason=stamps.loss)
        if stamps.skipped:
            self.note("late", skipped=stamps.skipped, lateness_ms=stamps.lateness_s * 1000)
        self._late += stamps.skipped > 0 or stamps.lateness_s > self.dt / 2

    def _note_settings(self, why: str) -> None:
        self.settings_id += 1
        settings = settings_to_dict(self.settings)
        self.note("settings", id=self.settings_id, why=why, settings=settings)

    def _record(self, user_input: UserInput, tick: Tick) -> StepRecord:
        stamps, step, after = self._stamps, self._assistant.step, self.world.snapshot()
        hand = self.world.hand_pose()
        known = STILL
        if self.phase == "running" and self._with_known_goal:
            known = self._assistant.known_goal_assistance(self._goal_index)
        return StepRecord(
            step=self._tick,
            time_s=self.time_s,
            monotonic_s=stamps.monotonic_s,
            wall_s=stamps.wall_s,
            phase=self.phase,
            outcome=self.outcome,
            sequence=user_input.sequence,
            client_time_ms=user_input.client_time,
            device=user_input.device,
            axes=list(user_input.axes),
            buttons=self._buttons,
            mode=user_input.mode,
            dead_zone=user_input.dead_zone,
            view_yaw_rad=user_input.view_yaw,
            input_norm=tick.input_norm,
            input_s=self._input_s,
            method=self.settings.method,
            enabled=self.settings.enabled,
            settings_id=self.settings_id,
            direct_twist=tick.direct.tolist(),
            assistance_twist=tick.assistance.tolist(),
            known_goal_assistance_twist=known.tolist(),
            executed_twist=tick.executed.tolist(),
            belief=tick.belief.tolist(),
            values=step.values.tolist(),
            q_values=step.q_values.tolist(),
            best_targets=step.best_targets.tolist(),
            hand_position_m=hand.position.tolist(),
            hand_quaternion=hand.quaternion.tolist(),
            joint_positions_rad=after.joint_positions,
            joint_velocities_rad_s=after.joint_velocities,
            finger_positions_m=after.finger_positions,
            ctrl=after.ctrl,
            object_poses=after.object_poses,
            lateness_s=stamps.lateness_s,
            round_trip_ms=stamps.round_trip_ms,
        )
