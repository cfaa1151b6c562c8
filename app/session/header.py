"""The header of a trial: everything that is fixed before its first tick."""

import hashlib
import platform
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

import msgspec

from app import __version__
from app.core import settings_to_dict
from app.recording.schema import TrialHeader

if TYPE_CHECKING:
    from app.session.trial import Trial

PHYSICS_PACKAGES = ("mujoco",)
"""Re-simulation is bit-identical only with these versions equal."""
_PACKAGES = (*PHYSICS_PACKAGES, "pin", "pin-pink", "daqp", "numpy", "numba", "viser", "mcap")


@dataclass(frozen=True, slots=True)
class TrialIdentity:
    """Which trial this is, for the header.

    Attributes:
        study: Name of the study.
        participant: Pseudonym.
        session: The participant's session number.
        trial: Number of the log within the session.
        attempt: How often this trial of the protocol was tried, from 1.
        shown_as: What the participant sees instead of the method's name.
        options: Further settings of the session, kept beside those of the method.
    """

    study: str = ""
    participant: str = ""
    session: str = "1"
    trial: int = 1
    attempt: int = 1
    shown_as: str = ""
    options: dict[str, Any] = field(default_factory=dict)


@cache
def versions() -> dict[str, str]:
    """Versions of this program, of Python and of the libraries that decide what a trial does."""
    found = {"hindsight": __version__, "python": platform.python_version()}
    found["machine"] = f"{platform.system()} {platform.machine()}"
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def make_header(trial: "Trial", wall_s: float) -> TrialHeader:
    """Header of a trial that has not been stepped yet."""
    world, identity = trial.world, trial.identity
    config = {
        "settings": settings_to_dict(trial.settings),
        "options": identity.options,
        "world": world.kind,
        **trial.rules(),
    }
    config_json = msgspec.json.encode(config, order="sorted").decode()
    targets = world.targets
    return TrialHeader(
        study=identity.study,
        participant=identity.participant,
        session=identity.session,
        trial=identity.trial,
        attempt=identity.attempt,
        instructed_goal=trial.goal,
        method=trial.settings.method,
        shown_as=identity.shown_as,
        seed=trial.seed,
        scene=world.scene.name,
        scene_json=world.scene.model_dump_json(),
        config_json=config_json,
        config_hash=hashlib.sha256(config_json.encode()).hexdigest(),
        model_hash=world.model_hash,
        versions_json=msgspec.json.encode(versions()).decode(),
        started_wall_s=wall_s,
        control_dt_s=trial.dt,
        physics_dt_s=world.physics_dt_s,
        goal_names=list(targets.names),
        object_names=list(world.scene.object_names),
        joint_names=list(world.joint_names),
        target_offsets=targets.offsets.tolist(),
        target_positions_m=targets.positions.ravel().tolist(),
        target_quaternions=targets.quaternions.ravel().tolist(),
        start_state=world.start_state(),
    )
