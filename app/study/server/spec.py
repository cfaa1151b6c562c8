"""From a trial of the protocol to what a worker is told; and what stays hidden from the page."""

from typing import Any

from app.session.session import SERVER
from app.session.spec import WorkerSpec
from app.study.load import HERE
from app.study.plan import Task
from app.study.schema import Condition, Study
from app.study.store import SESSION, Person, Store
from app.web.config import ServerConfig

NO_LAYERS = {
    "user": False,
    "assist": False,
    "ghosts": False,
    "tags": False,
    "path": False,
    "slice": False,
}
ALWAYS_HIDDEN = ("assistance", "method", "settings", "loop")
FREE_SCENE = "scenes/free.yaml"


def worker_key(task: Task) -> tuple[Any, ...]:
    """Trials with equal keys run in one worker, one after another."""
    return (task.part == "free", task.place)


def condition_of(study: Study, task: Task) -> Condition | None:
    """The condition of a trial; None for practice without a method."""
    return next((c for c in study.conditions if c.name == task.condition), None)


def worker_spec(
    store: Store, person: Person, task: Task, session_id: str, config: ServerConfig
) -> WorkerSpec:
    """The worker whose first trial this is.

    Args:
        store: The study's.
        person: Who does it.
        task: The trial that is due.
        session_id: Of the browser's session.
        config: The server's.
    """
    study, state = store.study, person.state
    condition = condition_of(study, task)
    free = condition is None
    settings: dict[str, Any] = {"preset": study.preset, "method": "direct"}
    factors: dict[str, Any] = {"part": task.part}
    display = "nothing"
    if condition is not None:
        settings |= {**condition.settings, "method": condition.method}
        display = condition.display
        factors |= {
            "condition": condition.name,
            "display": display,
            "input_delay_ms": condition.input_delay_ms,
            "device": condition.device,
        }
    hide = [*ALWAYS_HIDDEN]
    if display == "nothing":
        hide.append("belief")
    if not store.test:
        hide.append("positions")
    options = {
        **config.options,
        "record": True,
        "start": "signal",
        "timeout_s": 0.0 if free else study.trials.time_limit_s,
        "seed": task.seed + state.next_attempt - 1,
        "target": task.target,
        "theme": study.theme,
        "camera": study.camera,
        "layers": {**NO_LAYERS, "slice": display == "slice"},
        "hide": hide,
        "commands": ["start"] if free else ["start", "grasp"],
        "shown_as": task.label,
        "attempt": state.next_attempt,
        "show_objects": not free,
        "input_delay_s": condition.input_delay_ms / 1000 if condition else 0.0,
        "factors": factors,
    }
    return WorkerSpec(
        id=session_id,
        scene=free_scene() if free else study.scene,
        settings=settings,
        sessions=str(store.sessions),
        study=study.name,
        participant=person.id,
        session=SESSION,
        options=options,
    )


def free_scene() -> str:
    """Path of the scene for practice without objects."""
    return str(HERE / FREE_SCENE)


def trial_command(task: Task, attempt: int) -> dict[str, Any]:
    """The command by which a running worker sets up this trial."""
    return {
        "type": "command",
        "client": SERVER,
        "id": attempt,
        "name": "new-trial",
        "target": task.target,
        "seed": task.seed + attempt - 1,
        "shown_as": task.label,
        "attempt": attempt,
    }
