"""Discrete commands: checked once at the edge, then carried out in order."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from app.errors import AppError


class CommandError(AppError):
    """A command that cannot be carried out; the text is shown to the person who sent it."""


@dataclass(frozen=True, slots=True)
class Command:
    """One command, already checked.

    Attributes:
        name: One of `COMMANDS`.
        args: The command's own fields.
        client: Who sent it; the ack goes there.
        id: The sender's number for it, repeated in the ack.
    """

    name: str
    args: Mapping[str, Any] = field(default_factory=dict)
    client: str = ""
    id: int = 0


def _text(value: object) -> bool:
    return isinstance(value, str) and 0 < len(value) <= 200


def _seed(value: object) -> bool:
    return type(value) is int and 0 <= value < 2**53


def _flag(value: object) -> bool:
    return isinstance(value, bool)


def _changes(value: object) -> bool:
    return isinstance(value, dict) and 0 < len(value) <= 64 and all(map(_plain, value.values()))


def _plain(value: object) -> bool:
    if isinstance(value, float):
        return math.isfinite(value)
    return value is None or isinstance(value, (bool, int, str))


@dataclass(frozen=True)
class _Field:
    check: Callable[[object], bool]
    wanted: str
    required: bool = True


_TEXT = _Field(_text, "a text of 1 to 200 characters")
_OPTIONAL_TEXT = _Field(_text, "a text of 1 to 200 characters", required=False)
_OPTIONAL_SEED = _Field(_seed, "a whole number from 0 to 2**53", required=False)
_CHANGES = _Field(_changes, "an object of plain values, 1 to 64 of them")

COMMANDS: dict[str, dict[str, _Field]] = {
    "start": {},
    "grasp": {},
    "open": {},
    "hold": {},
    "new-trial": {
        "target": _OPTIONAL_TEXT,
        "seed": _OPTIONAL_SEED,
        "method": _OPTIONAL_TEXT,
        "scene": _OPTIONAL_TEXT,
        "shown_as": _OPTIONAL_TEXT,
        "attempt": _OPTIONAL_SEED,
    },
    "method": {"method": _TEXT},
    "assist": {"enabled": _Field(_flag, "true or false")},
    "settings": {"changes": _CHANGES},
    "layers": {"changes": _CHANGES},
    "camera": {"preset": _TEXT},
    "theme": {"theme": _Field(lambda v: v in ("dark", "light"), "dark or light")},
}
"""Name of each command and its fields. `start` releases the arm where the trial waits for it."""


def parse_command(message: Mapping[str, Any]) -> Command:
    """Check a command message; values that depend on the scene are checked where they are used.

    Raises:
        CommandError: Naming the field, its value and what is valid.
    """
    name = message.get("name")
    wanted = COMMANDS.get(name) if isinstance(name, str) else None
    if wanted is None or not isinstance(name, str):
        raise CommandError(f"command {name!r} is unknown; valid: {', '.join(COMMANDS)}")
    envelope = ("type", "client", "id", "name")
    args = {k: v for k, v in message.items() if k not in envelope and v is not None}
    for key, value in args.items():
        if key not in wanted:
            valid = ", ".join(wanted) or "none"
            raise CommandError(f"{name} has no field {key!r}; valid: {valid}")
        if not wanted[key].check(value):
            raise CommandError(f"{name}: {key} is {value!r}; valid: {wanted[key].wanted}")
    for key, rule in wanted.items():
        if rule.required and key not in args:
            raise CommandError(f"{name} needs {key}: {rule.wanted}")
    number = message.get("id", 0)
    return Command(name, args, str(message.get("client", "")), number if type(number) is int else 0)
