"""What a browser may say on its input socket, checked field by field."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from app.errors import AppError

MAX_MESSAGE_BYTES = 4096
MAX_INTEGER = 2**53 - 1
"""The largest integer that a browser's numbers hold exactly."""


class MessageError(AppError):
    """A browser's message is refused; the text goes back to it."""

    def __init__(self, text: str, command_id: int | None = None) -> None:
        super().__init__(text)
        self.command_id = command_id
        """Number of the command that was refused, where it could be read."""


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


Sequence = Annotated[int, Field(ge=0, le=MAX_INTEGER)]
Milliseconds = Annotated[float, Field(ge=0, le=1e15)]
Axis = Annotated[float, Field(ge=-1, le=1)]
Name = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[\w .:/+-]+$")]
Scalar = Annotated[bool | int | float | str | None, Field(union_mode="smart")]
Changes = Annotated[dict[Name, Scalar], Field(min_length=1, max_length=64)]


class InputMessage(_Strict):
    """One reading of the sticks."""

    type: Literal["input"]
    seq: Sequence
    t: Milliseconds
    left: Annotated[list[Axis], Field(min_length=2, max_length=2)]
    right: Annotated[list[Axis], Field(min_length=2, max_length=2)]
    mode: Literal["translate", "rotate"] = "translate"
    device: Literal["pointer", "keyboard", "gamepad", "none"] = "none"
    yaw: Annotated[float, Field(ge=-100, le=100)] = 0.0
    dead_zone: Annotated[float, Field(ge=0, le=0.95)] = 0.1


class EventMessage(_Strict):
    """The page lost or gained the person's attention, the whole screen, or its frame rate."""

    type: Literal["event"]
    name: Literal[
        "blur", "focus", "hidden", "visible", "fullscreen", "windowed", "frames_low", "frames_ok"
    ]


class PingMessage(_Strict):
    """Once a second; `rtt` is what the page measured last [ms]."""

    type: Literal["ping"]
    t: Milliseconds
    rtt: Annotated[float, Field(ge=0, le=1e9)] | None = None


class Command(_Strict):
    """Something to be done once; answered by an `ack` with the same id."""

    type: Literal["command"]
    id: Sequence


class PlainCommand(Command):
    """A command without arguments."""

    name: Literal["start", "grasp", "open", "hold"]


class NewTrialCommand(Command):
    """Begin a new trial; what is missing is the server's choice."""

    name: Literal["new-trial"]
    target: Name | None = None
    seed: Sequence | None = None
    method: Name | None = None
    scene: Name | None = None


class MethodCommand(Command):
    """Switch the assistance method."""

    name: Literal["method"]
    method: Name


class AssistCommand(Command):
    """Assistance on or off."""

    name: Literal["assist"]
    enabled: bool


class ChangesCommand(Command):
    """Change settings of the method, or layers of the view."""

    name: Literal["settings", "layers"]
    changes: Changes


class CameraCommand(Command):
    """Go to a camera preset."""

    name: Literal["camera"]
    preset: Name


class ThemeCommand(Command):
    """Draw in the page's theme."""

    name: Literal["theme"]
    theme: Literal["dark", "light"]


_AnyCommand = Annotated[
    PlainCommand
    | NewTrialCommand
    | MethodCommand
    | AssistCommand
    | ChangesCommand
    | CameraCommand
    | ThemeCommand,
    Field(discriminator="name"),
]
BrowserMessage = InputMessage | EventMessage | PingMessage | Command

_ADAPTER: TypeAdapter[BrowserMessage] = TypeAdapter(
    Annotated[InputMessage | EventMessage | PingMessage | _AnyCommand, Field(discriminator="type")]
)


class _Numbered(BaseModel):
    """Just enough of a refused command to answer it."""

    type: Literal["command"]
    id: Sequence


def parse_message(text: str) -> BrowserMessage:
    """Check one text frame.

    Raises:
        MessageError: Naming the value and what is valid.
    """
    size = len(text.encode())
    if size > MAX_MESSAGE_BYTES:
        raise MessageError(f"message of {size} bytes; valid: at most {MAX_MESSAGE_BYTES}")
    try:
        return _ADAPTER.validate_json(text)
    except ValidationError as error:
        raise MessageError(_explain(error), _command_id(text)) from None


def _explain(error: ValidationError) -> str:
    """One sentence on the first complaint."""
    first = error.errors(include_url=False)[0]
    path = first["loc"][2 if first["loc"][:1] == ("command",) else 1 :]
    name = ".".join(map(str, path)) or "message"
    if first["type"] == "missing":
        return f"{name} is missing"
    value = repr(first["input"])
    value = value if len(value) <= 80 else value[:77] + "…"
    return f"{name} is {value}; {first['msg'][0].lower()}{first['msg'][1:]}"


def _command_id(text: str) -> int | None:
    try:
        return _Numbered.model_validate_json(text).id
    except ValidationError:
        return None
