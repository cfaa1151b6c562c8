"""Simulated users: one small class each, one table."""

from app.simulate.models.base import Action, Sight, User
from app.simulate.models.parameters import Parameter
from app.simulate.models.pursuit import Continue, Fight, Lazy
from app.simulate.models.sampler import MaxEnt
from app.simulate.models.wanting import ChangesMind, Idle, Unmodelled

MODELS: dict[str, type[User]] = {
    "continue": Continue,
    "lazy": Lazy,
    "fight": Fight,
    "maxent": MaxEnt,
    "changes-mind": ChangesMind,
    "idle": Idle,
    "unmodelled": Unmodelled,
}
"""Name in population files → class."""

__all__ = ["MODELS", "Action", "Parameter", "Sight", "User"]
