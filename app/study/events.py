"""What happens to a participant, as it is written to `events.jsonl`: the protocol's only record.

Each is one line `{"wall_s": …, "name": "protocol", "event": {"type": …, …}}`. Names of conditions
appear here, on the server; free text does not: it lies in `private/`.
"""

from typing import Any

import msgspec

NAME = "protocol"


class Event(msgspec.Struct, frozen=True, kw_only=True, tag_field="type"):
    """Base of all events."""


class Consented(Event, frozen=True, tag="consented"):
    """The first event: who takes part in which cell, under which words."""

    version: str
    digest: str
    cell: int
    slot: int
    pilot: bool = False
    test: bool = False
    fast: bool = False


class Answered(Event, frozen=True, tag="answered"):
    """Answers of a page; free text is replaced by its length."""

    page: str
    """background, device, or a survey's id."""
    values: dict[str, Any]


class Drafted(Event, frozen=True, tag="drafted"):
    """Answers so far of a page that was not submitted yet."""

    page: str
    values: dict[str, Any]


class Passed(Event, frozen=True, tag="passed"):
    """A page without answers was left by Continue."""

    page: str


class Returned(Event, frozen=True, tag="returned"):
    """Back to the survey before, whose answers can be changed again."""

    page: str


class AttemptStarted(Event, frozen=True, tag="attempt_started"):
    """A trial stands ready in a worker."""

    index: int
    """Of the step in the plan."""
    attempt: int
    trial: int
    """Number of its log."""
    part: str
    place: int
    condition: str
    label: str
    target: str
    seed: int


class AttemptEnded(Event, frozen=True, tag="attempt_ended"):
    """Its outcome is known, and its log is on the disk unless it was interrupted."""

    index: int
    attempt: int
    trial: int
    outcome: str
    reason: str = ""


class ExtraAsked(Event, frozen=True, tag="extra_asked"):
    """A further training trial was asked for."""

    place: int


class Excluded(Event, frozen=True, tag="excluded"):
    """An answer rules out taking part, or the experimenter ended the session."""

    reason: str


class Redone(Event, frozen=True, tag="redone"):
    """The experimenter lets a trial be done again; what it gave so far does not count."""

    index: int


class Skipped(Event, frozen=True, tag="skipped"):
    """The experimenter passes over a step."""

    index: int


class Noted(Event, frozen=True, tag="noted"):
    """The experimenter wrote a note, which lies in `private/`."""

    number: int


class Left(Event, frozen=True, tag="left"):
    """The participant withdrew; what follows is the deletion."""


AnyEvent = (
    Consented
    | Answered
    | Drafted
    | Passed
    | Returned
    | AttemptStarted
    | AttemptEnded
    | ExtraAsked
    | Excluded
    | Redone
    | Skipped
    | Noted
    | Left
)


def to_detail(event: AnyEvent) -> dict[str, Any]:
    """The event as a line of events.jsonl holds it."""
    return {"event": msgspec.to_builtins(event)}


def from_line(line: dict[str, Any]) -> AnyEvent | None:
    """The event of a line; None for lines of other rooms.

    Raises:
        msgspec.ValidationError: If the event is none of ours.
    """
    if line.get("name") != NAME:
        return None
    return msgspec.convert(line.get("event"), AnyEvent)
