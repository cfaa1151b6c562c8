"""One participant's session: trial after trial, in the loop's thread."""

import random
import time
from collections.abc import Callable, Mapping
from typing import Any

from app.core import AssistanceSettings, UserInput, settings_to_dict
from app.errors import AppError
from app.robot.objects import object_height
from app.robot.scene import Scene
from app.robot.scene_file import list_scenes, load_scene
from app.session.assistant import change_settings, method_changes
from app.session.autopilot import Autopilot, Driver
from app.session.commands import Command, CommandError, parse_command
from app.session.frame import Frame, TrialView
from app.session.header import TrialIdentity
from app.session.inbox import Inbox
from app.session.loop import Health
from app.session.pacing import Beat
from app.session.physics_world import PhysicsWorld
from app.session.plan import TargetOrder
from app.session.recorder import Recorder
from app.session.spec import SessionOptions, WorkerSpec
from app.session.stamps import Stamps
from app.session.trial import Trial
from app.session.viewing import Viewing
from app.session.watchdog import Loss

Say = Callable[[dict[str, Any]], None]
SERVER = "server"
"""Client name of commands from the web process itself; they are never refused by `commands`."""
LINGER_TICKS = 50
"""How long a done trial is still recorded: the log ends with the hand at rest."""
PROBLEM_TICKS = 100
"""How often the log's health is looked at."""
_VIEW_COMMANDS = ("layers", "camera", "theme")


class Session:
    """Owns the world and the trial; told of commands, stepped by the loop.

    Attributes:
        trial: The one that is shown now.
    """

    def __init__(
        self,
        spec: WorkerSpec,
        options: SessionOptions,
        scene: Scene,
        settings: AssistanceSettings,
        inbox: Inbox,
        recorder: Recorder,
        say: Say,
        driver: Driver | None = None,
    ) -> None:
        """Set up the first trial.

        Args:
            spec: Who and where.
            options: The spec's options, validated.
            scene: The first scene.
            settings: The first trial's.
            inbox: Where input and commands arrive.
            recorder: Where records go.
            say: Sends a message that must arrive.
            driver: Steers while no visitor does; None: nobody does.

        Raises:
            AppError: If a target, method or setting is not valid.
        """
        self._spec, self._options = spec, options
        self._inbox, self._recorder, self._say = inbox, recorder, say
        self._first_scene, self._first_settings = scene, settings
        self._autopilot = None if driver is None else Autopilot(driver)
        self._preset = str(spec.settings.get("preset", "default"))
        seed = random.SystemRandom().randrange(2**31) if options.seed is None else options.seed
        self._seed = seed
        self._order = TargetOrder(scene.object_names, seed)
        self._world = PhysicsWorld(scene, seed)
        self._on_frame: list[Callable[[Frame], None]] = []
        self._viewing: Viewing | None = None
        self._restart_clock: Callable[[], None] = lambda: None
        self._on_scene: Callable[[], None] = lambda: None
        self._health: Callable[[], Health] = Health
        self._problem: str | None = None
        self._control: object = None
        self._left = False
        self._done_ticks = 0
        self._shown_as = options.shown_as
        target = options.target or self._order.next()
        self.trial = self._begin(settings, target, options.attempt)

    @property
    def scene(self) -> Scene:
        """The scene that is shown now."""
        return self._world.scene

    @property
    def view(self) -> TrialView:
        """What the page is told of the trial."""
        return self._view

    def connect(
        self,
        viewing: Viewing,
        readers: list[Callable[[Frame], None]],
        health: Callable[[], Health],
        restart_clock: Callable[[], None],
        on_scene: Callable[[], None],
    ) -> None:
        """Attach what came after the first trial.

        Args:
            viewing: The 3-D view.
            readers: Offered every frame; may not block.
            health: The loop's figures.
            restart_clock: Called after work that is no tick.
            on_scene: Called where another scene is shown.
        """
        self._viewing = viewing
        self._on_frame = readers
        self._health = health
        self._restart_clock = restart_clock
        self._on_scene = on_scene

    # the tick

    def tick(self, beat: Beat) -> None:
        """Carry out what waits, step the trial, offer the record to its readers."""
        for message in self._inbox.take():
            self._handle(message)
        user_input, loss = self._inbox.gate.current(beat.at_s)
        if self._autopilot is not None:
            user_input, loss = self._let_drive(self._autopilot, user_input, loss, beat.at_s)
        stamps = Stamps(
            monotonic_s=beat.at_s,
            wall_s=time.time(),
            lateness_s=beat.lateness_s,
            round_trip_ms=self._inbox.round_trip_ms,
            skipped=beat.skipped,
            loss=loss,
        )
        trial = self.trial
        record = trial.step(user_input, (), stamps)
        self._recorder.write(record, trial.take_events())
        if trial.settings_id != self._view_settings_id:
            self._look()
        frame = Frame(
            record=record,
            view=self._view,
            goals=trial.goals,
            settings=trial.settings,
            seconds=trial.duration_s,
            outcome=trial.outcome,
            grasped=trial.grasped_object,
            health=self._health(),
            loss=loss,
        )
        for offer in self._on_frame:
            offer(frame)
        if trial.phase == "done":
            self._done_ticks += 1
            if self._done_ticks == LINGER_TICKS:
                self._recorder.finish(trial.summary(stamps.wall_s))
        if trial.tick % PROBLEM_TICKS == 0:
            self._tell_problem()

    def _let_drive(
        self, autopilot: Autopilot, user_input: UserInput, loss: Loss, now_s: float
    ) -> tuple[UserInput, Loss]:
        """The input of the tick, the driver's or the visitor's, and why it is missing."""
        change = autopilot.watch(user_input, now_s)
        if change == "handed-over":
            self._note_handover()
        elif change == "resumed" or (autopilot.drives and autopilot.driver.wants_next(self.trial)):
            # The visitor's scene and settings leave with them.
            name = self._first_scene.name
            self._new_trial(Command("new-trial", {"scene": name}), self._first_settings)
        if not autopilot.drives:
            return user_input, loss
        user_input, close = autopilot.driver.act(self.trial)
        if close:
            self.trial.command(Command("grasp"))
        return user_input, ""

    def _note_handover(self) -> None:
        self.trial.note("handover", to="visitor")
        self._look()

    def close(self) -> None:
        """End the trial and its log."""
        if self._recorder.is_open:
            self.trial.note("end")
            for event in self.trial.take_events():
                self._recorder.write_event(event)
            self._recorder.finish(self.trial.summary(time.time()))

    # messages

    def _handle(self, message: Mapping[str, Any]) -> None:
        kind = message.get("type")
        if kind == "event":
            self.trial.note(str(message.get("name", "")), client=str(message.get("client", "")))
        elif kind == "clients":
            self._note_control(message.get("control"))
        elif kind == "command":
            self._answer(message)

    def _note_control(self, control: object) -> None:
        """Record that the page in control is gone, or is back; spectators come and go unnoted."""
        had, self._control = self._control, control
        if had is not None and control is None:
            self.trial.note("disconnect")
            self._left = True
        elif had is None and control is not None and self._left:
            self.trial.note("reconnect")

    def _answer(self, message: Mapping[str, Any]) -> None:
        try:
            command = parse_command(message)
            allowed = self._options.commands
            if command.client != SERVER and allowed is not None and command.name not in allowed:
                valid = ", ".join(allowed) or "none"
                raise CommandError(f"{command.name} is not possible here; valid: {valid}")
            if command.name in _VIEW_COMMANDS and self._viewing is not None:
                self._viewing.request(
                    command.name, command.args, lambda error: self._acknowledge(message, error)
                )
                return
            if self._autopilot is not None and command.client != SERVER and self._autopilot.take():
                self._note_handover()
            if command.name == "new-trial":
                self._new_trial(command, self.trial.settings)
            else:
                self.trial.command(command)
        except AppError as error:
            self._acknowledge(message, str(error))
        else:
            self._acknowledge(message, None)

    def _acknowledge(self, message: Mapping[str, Any], error: str | None) -> None:
        ack = {"type": "ack", "id": message.get("id"), "client": message.get("client")}
        self._say({**ack, "error": error})

    def _tell_problem(self) -> None:
        problem = self._recorder.problem
        if problem != self._problem:
            self._problem = problem
            text = problem or "The log is being written again."
            self._say({"type": "notice", "level": "error" if problem else "info", "text": text})

    # trials

    def _new_trial(self, command: Command, settings: AssistanceSettings) -> None:
        """End this trial and begin another; where the command is not valid, nothing happens."""
        args = command.args
        scene = self._scene_for(args.get("scene"), from_server=command.client == SERVER)
        target = args.get("target")
        if target is not None:
            scene.object_index(target)
        if "method" in args:
            changes = method_changes(settings, args["method"], self._preset)
            settings = change_settings(settings, changes)
        seed = args.get("seed", self._seed + 1)
        changed = scene != self.scene
        world = PhysicsWorld(scene, seed) if changed else self._world
        self.close()
        world.reset(seed)
        self._world, self._seed = world, seed
        if changed or "seed" in args:
            self._order = TargetOrder(scene.object_names, seed)
        if target is None:
            target = self._order.next()
        else:
            self._order.note(target)
        self._shown_as = args.get("shown_as", self._shown_as)
        self.trial = self._begin(settings, target, args.get("attempt", 1))
        if changed:
            if self._viewing is not None:
                self._viewing.show_scene(scene)
            self._on_scene()
        self._restart_clock()

    def _scene_for(self, name: str | None, *, from_server: bool) -> Scene:
        """The scene of the next trial; a browser chooses among the shipped ones and the first."""
        if name is None or name == self.scene.name:
            return self.scene
        if name == self._first_scene.name or name == self._spec.scene:
            return self._first_scene
        if not from_server and name not in list_scenes():
            raise CommandError(f"scene is {name!r}; valid: {', '.join(list_scenes())}")
        return load_scene(name)

    def _begin(self, settings: AssistanceSettings, target: str, attempt: int) -> Trial:
        spec, options = self._spec, self._options
        identity = TrialIdentity(
            study=spec.study,
            participant=spec.participant or spec.id,
            session=spec.session,
            trial=self._recorder.next_number(),
            attempt=attempt,
            shown_as=self._shown_as,
            options={**options.factors, **({"driver": "simulated"} if self._is_driven else {})},
        )
        trial = Trial(
            self._world,
            settings,
            target,
            seed=self._seed,
            identity=identity,
            preset=self._preset,
            start=options.start,
            timeout_s=options.timeout_s,
            hold_on_loss=options.hold_on_loss,
            wall_s=time.time(),
        )
        self._recorder.begin(trial.header())
        self._done_ticks = 0
        self.trial = trial
        self._look()
        return trial

    @property
    def _is_driven(self) -> bool:
        return self._autopilot is not None and self._autopilot.drives

    def _look(self) -> None:
        trial = self.trial
        self._view_settings_id = trial.settings_id
        self._view = TrialView(
            number=trial.identity.trial,
            target=trial.goal,
            shown_as=trial.identity.shown_as,
            scene=self.scene.name,
            seed=trial.seed,
            goal_names=self.scene.object_names,
            object_names=self.scene.object_names,
            object_heights_m=tuple(object_height(item) for item in self.scene.objects),
            settings=settings_to_dict(trial.settings),
            simulated=self._is_driven,
        )
