"""Real logs for the review's tests: a scripted person, the real physics, the real writer."""

from collections.abc import Callable
from pathlib import Path

from app.core import UserInput, preset
from app.recording.store import open_session
from app.recording.writer import TrialWriter
from app.robot.scene_file import load_scene
from app.session.commands import Command
from app.session.header import TrialIdentity
from app.session.physics_world import PhysicsWorld
from app.session.trial import Trial
from tests.session.person import Person

Script = Callable[[Trial, int], list[Command]]
WALL_S = 1_760_000_000.0


def no_commands(_: Trial, __: int) -> list[Command]:
    """A person who only steers."""
    return []


def record_trial(
    root: Path,
    goal: str,
    *,
    method: str = "policy",
    seed: int = 3,
    participant: str = "p01",
    number: int = 1,
    study: str = "pilot",
    limit_s: float = 20.0,
    script: Script = no_commands,
    live: bool = False,
) -> Path:
    """Do one trial and write its log; returns the log's path.

    Args:
        root: The folder of all sessions.
        goal: What the person grasps.
        method: Assistance at the start.
        seed: Of the layout.
        participant: Who.
        number: Of the trial.
        study: Of which study.
        limit_s: The person stops there at the latest [s].
        script: Further commands by tick.
        live: Look at the goals in every tick, as live sessions do for their picture.
    """
    scene = load_scene("default")
    identity = TrialIdentity(study=study, participant=participant, session="1", trial=number)
    trial = Trial(
        PhysicsWorld(scene, seed),
        preset("default", method=method),
        goal,
        seed=seed,
        identity=identity,
        start_delay_s=0.1,
        wall_s=WALL_S + number,
    )
    folder = open_session(root, study, participant, "1")
    writer = TrialWriter(folder, trial.header())
    person, record = Person(goal), None
    for tick in range(round(limit_s / trial.dt)):
        user_input, commands = UserInput(device="person"), []
        if record is not None and trial.phase == "running":
            user_input, commands = person.act(trial, record)
        record = trial.step(user_input, [*commands, *script(trial, tick)])
        if live:
            _ = trial.goals
        writer.write(record)
        for event in trial.take_events():
            writer.write_event(event)
        if trial.phase == "done" and commands == []:
            break
    for event in trial.take_events():
        writer.write_event(event)
    path = writer.close(trial.summary(WALL_S + 60.0))
    assert path is not None, writer.error
    writer.join()  # its cache is there from now on
    return path
