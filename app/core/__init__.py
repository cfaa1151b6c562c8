"""The method itself, pure: goals with targets and user inputs in; twist, belief, V and Q out."""

from app.core.arbitration import ARBITRATIONS
from app.core.backend import warm_up
from app.core.belief import PREDICTORS
from app.core.commands import compute_command, compute_input
from app.core.errors import CoreError
from app.core.goals import make_goals
from app.core.methods import METHODS
from app.core.pipeline import (
    AssistanceState,
    AssistanceStep,
    assist,
    counterfactuals,
    initial_state,
    known_goal_twist,
    known_goal_twist_of_step,
)
from app.core.presets import PRESETS, preset
from app.core.settings import AssistanceSettings, settings_from_dict, settings_to_dict
from app.core.slices import value_slice
from app.core.types import Goals, Mode, Pose, UserInput

__all__ = [
    "ARBITRATIONS",
    "METHODS",
    "PREDICTORS",
    "PRESETS",
    "AssistanceSettings",
    "AssistanceState",
    "AssistanceStep",
    "CoreError",
    "Goals",
    "Mode",
    "Pose",
    "UserInput",
    "assist",
    "compute_command",
    "compute_input",
    "counterfactuals",
    "initial_state",
    "known_goal_twist",
    "known_goal_twist_of_step",
    "make_goals",
    "preset",
    "settings_from_dict",
    "settings_to_dict",
    "value_slice",
    "warm_up",
]
