"""What the web process tells a worker before it starts."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal, get_args

from app.errors import AppError

StartRule = Literal["auto", "input", "signal"]
"""What releases the arm. auto: 0.5 s have passed since the trial was made. input: the first push.
signal: the command `start`."""

START_DELAY_S = 0.5
"""How long a live trial holds the arm, so that its first picture is still [s]."""


class SpecError(AppError):
    """An option of a worker is unknown or out of range."""


@dataclass(frozen=True)
class WorkerSpec:
    """One participant session, as it crosses the boundary (only plain values).

    Attributes:
        id: The session's public id; no secret.
        scene: Name of a shipped scene, or the path of a scene file.
        settings: Changes to the default preset, as `settings_from_dict` reads them; the key
            "preset" chooses another preset.
        sessions: Folder that holds all sessions.
        study: Name of the study; "demo" for live demonstrations.
        participant: Pseudonym of the participant; empty: the session's id.
        session: The participant's session number.
        options: See `SessionOptions`.
    """

    id: str
    scene: str
    settings: dict[str, Any]
    sessions: str
    study: str = "demo"
    participant: str = ""
    session: str = "1"
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class SessionOptions:
    """The options of a WorkerSpec, validated; every key is optional.

    Attributes:
        record: Whether trials are written to disk.
        hold_on_loss: Whether lost input stops the arm instead of leaving it to the method.
        seed: Seed of the first trial (scene layout); later trials add one. None: drawn.
        method: Method of the first trial; empty: the settings' own.
        target: Instructed goal of the first trial; empty: random order of all objects.
        start: When the arm is released.
        timeout_s: A running trial ends with outcome "timeout" after this long; 0: never; None:
            the scene's own limit [s].
        viewer_hz: Most viewer updates a second.
        status_hz: Most status messages a second.
        theme: "dark" or "light".
        layers: Changes to the layers that are drawn first.
        camera: First camera preset.
        hide: Parts of the status that must not reach the browser in a study: any of
            `HIDEABLE`.
        commands: Commands the browser may send; None: all. Messages whose client is "server"
            (the web process itself) are always allowed.
        watch: Path of the read-only link, for hello; None: there is none.
        shown_as: What the first trial's method is called on the page.
        attempt: Which attempt at its trial of the protocol the first one is.
        show_objects: Whether the objects and the target's ring are drawn.
        input_delay_s: How much later than it came the person's input takes effect [s].
        factors: What else a study varies, kept with every trial's configuration.
    """

    record: bool = True
    hold_on_loss: bool = False
    seed: int | None = None
    method: str = ""
    target: str = ""
    start: StartRule = "auto"
    timeout_s: float | None = None
    viewer_hz: float = 60.0
    status_hz: float = 30.0
    theme: str = "dark"
    layers: Mapping[str, Any] = field(default_factory=dict)
    camera: str = "operator"
    hide: tuple[str, ...] = ()
    commands: tuple[str, ...] | None = None
    watch: str | None = None
    shown_as: str = ""
    attempt: int = 1
    show_objects: bool = True
    input_delay_s: float = 0.0
    factors: Mapping[str, Any] = field(default_factory=dict)


HIDEABLE = ("belief", "assistance", "method", "positions", "settings", "loop", "outcome")
"""belief: probabilities, reasons, value range, leading target, drawn slices and ghosts;
assistance: what the method adds; method: its real name (`shown_as` stays); positions: hand and
objects; settings: constants of the method; loop: timing; outcome: whether the grasp was right."""


def parse_options(options: Mapping[str, Any]) -> SessionOptions:
    """Validate the options of a spec.

    Raises:
        SpecError: Naming the option, its value and what is valid.
    """
    known = {f.name: f.default for f in fields(SessionOptions)}
    for name in options:
        if name not in known:
            raise SpecError(f"option {name!r} is unknown; valid: {', '.join(known)}")
    values: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in options.items()}
    parsed = SessionOptions(**values)
    _check("start", parsed.start, parsed.start in get_args(StartRule), "auto, input or signal")
    _check("theme", parsed.theme, parsed.theme in ("dark", "light"), "dark or light")
    bounds = (("viewer_hz", 1, 100), ("status_hz", 1, 60), ("timeout_s", 0, 3600))
    for name, low, high in (*bounds, ("input_delay_s", 0, 1), ("attempt", 1, 10**6)):
        value = getattr(parsed, name)
        if name == "timeout_s" and value is None:
            continue
        number = isinstance(value, (int, float)) and math.isfinite(value)
        _check(name, value, number and low <= value <= high, f"a number from {low} to {high}")
    seed = parsed.seed
    _check("seed", seed, seed is None or (type(seed) is int and seed >= 0), "a whole number >= 0")
    hide = ", ".join(HIDEABLE)
    _check("hide", parsed.hide, set(parsed.hide) <= set(HIDEABLE), f"any of {hide}")
    return parsed


def _check(name: str, value: object, valid: bool, wanted: str) -> None:
    if not valid:
        raise SpecError(f"option {name} is {value!r}; valid: {wanted}")
