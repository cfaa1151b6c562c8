"""Which of the view's layers are shown, and what the value slice shows."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal, get_args

from app.errors import AppError

SlicePlane = Literal["table", "hand", "vertical"]
"""table: level, on the table's top. hand: level, at the hand's height. vertical: the plane of x and
z through the hand, which faces the operator's and the side camera."""

BELIEF, SOFT_MIN = "belief", "soft-min"
"""Values of `slice_of` beside the goals' names, both Σ_g b(g) V_g: with V over a goal's targets as
assistance takes it (the least), or as prediction does (−log Σ_κ exp(−V_κ))."""

_SWITCHES = ("user", "assist", "ghosts", "tags", "path", "slice")


class LayersError(AppError):
    """A layer that does not exist, or a value it cannot take."""


@dataclass(frozen=True, slots=True)
class Layers:
    """The switches of the view.

    Attributes:
        user: Arrow of the user's command D(u).
        assist: Arrow of what assistance adds.
        ghosts: The gripper at the grasps the robot is heading for.
        tags: The frames that the page hangs probabilities on.
        path: Where the hand has been in this trial.
        slice: The value function on a plane.
        slice_of: "belief", "soft-min" or a goal's name.
        slice_plane: Where the slice lies.
    """

    user: bool = True
    assist: bool = True
    ghosts: bool = True
    tags: bool = True
    path: bool = False
    slice: bool = True
    slice_of: str = BELIEF
    slice_plane: SlicePlane = "table"

    def changed(self, changes: Mapping[str, Any], goals: tuple[str, ...]) -> "Layers":
        """These layers with some changes.

        Args:
            changes: New values by name.
            goals: Names that `slice_of` may take beside "belief" and "soft-min".

        Raises:
            LayersError: If a name is unknown or a value invalid; nothing is changed then.
        """
        valid: dict[str, tuple[Any, ...]] = {name: (True, False) for name in _SWITCHES}
        valid["slice_of"] = (BELIEF, SOFT_MIN, *goals)
        valid["slice_plane"] = get_args(SlicePlane)
        for name, value in changes.items():
            if name not in valid:
                raise LayersError(f"layer {name!r} does not exist; valid are: {', '.join(valid)}")
            allowed = valid[name]
            if not any(value is v or (isinstance(v, str) and value == v) for v in allowed):
                options = ", ".join(str(v).lower() if v in (True, False) else v for v in allowed)
                raise LayersError(f"layer {name} cannot be {value!r}; valid are: {options}")
        return replace(self, **changes)

    def to_dict(self) -> dict[str, Any]:
        """The switches as plain values by name."""
        return asdict(self)
