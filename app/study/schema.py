"""What a study file says: conditions, order, trials, texts, surveys."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from app.core import METHODS
from app.core.errors import CoreError
from app.core.presets import PRESETS, preset
from app.study.items import Item, ItemName, Sentence, Strict, Survey
from app.study.yaml_file import FieldProblem

Display = Literal["nothing", "leading", "belief", "slice"]
"""What the page shows of the inference: nothing, the leading goal's name, a probability per object,
or those with the value function on the table."""
Seconds = Annotated[float, Field(ge=0, le=600)]


class Condition(Strict):
    """One level of what is compared; participants only ever see its label."""

    name: ItemName
    method: str
    settings: dict[str, Any] = Field(default_factory=dict)
    display: Display = "nothing"
    input_delay_ms: Annotated[float, Field(ge=0, le=1000)] = 0.0
    device: Literal["any", "pointer", "keyboard", "gamepad"] = "any"


class Training(Strict):
    """What comes before the recorded trials."""

    free_s: Seconds = 60.0
    """How long direct teleoperation without objects is offered; 0: not at all [s]."""
    each_object: bool = True
    """Each object once with each method; else one object a method."""
    extra: Annotated[int, Field(ge=0, le=50)] = 6
    """Most optional further trials."""


class Trials(Strict):
    """The recorded trials, and what holds for training trials as well."""

    repetitions: Annotated[int, Field(ge=1, le=20)] = 1
    """Blocks in which each object comes once, per method."""
    attempts: Annotated[int, Field(ge=1, le=20)] = 5
    """A failed trial is repeated until there were so many; interruptions do not count."""
    time_limit_s: Annotated[float, Field(ge=5, le=600)] = 60.0
    countdown_s: Annotated[float, Field(ge=0, le=30)] = 3.0
    expected_s: Annotated[float, Field(ge=1, le=600)] = 20.0
    """Typical trial, pauses included, for the expected duration."""


class Consent(Strict):
    """What a participant agrees to, in so many words; the version and a digest are kept."""

    version: Annotated[str, Field(min_length=1, max_length=40)]
    title: Sentence = "Taking part"
    paragraphs: Annotated[tuple[Sentence, ...], Field(min_length=1)]
    kept: Annotated[tuple[Sentence, ...], Field(min_length=1)]
    """Which data are kept."""
    retention: Sentence
    withdrawal: Sentence
    contact: Sentence
    agree: Sentence = "I have read this, I am at least 18 years old, and I want to take part."


class Device(Strict):
    """What the device check asks for; what falls short is said, and may bar."""

    min_width_px: Annotated[int, Field(ge=200, le=4000)] = 640
    min_frame_rate_hz: Annotated[float, Field(ge=1, le=240)] = 20.0
    max_round_trip_ms: Annotated[float, Field(ge=1, le=5000)] = 250.0
    required: tuple[Literal["webgl", "screen", "frame_rate", "round_trip", "gamepad"], ...] = (
        "webgl",
    )


class Arrival(Strict):
    """How participants come: by link (recruitment parameters in the URL) or with a code."""

    parameters: Annotated[tuple[str, ...], Field(max_length=8)] = (
        "PROLIFIC_PID",
        "STUDY_ID",
        "SESSION_ID",
    )
    person: str = "PROLIFIC_PID"
    """The parameter that names a person, who takes part once."""
    require: Literal["nothing", "parameters", "code"] = "nothing"
    codes: tuple[Annotated[str, Field(min_length=4, max_length=40)], ...] = ()


class Completion(Strict):
    """What a participant is given at the end; an empty code: one of their own."""

    code: Annotated[str, Field(max_length=60)] = ""
    redirect: str = ""


class Analysis(Strict):
    """Reference condition and the one held against it, for `hindsight analyze`."""

    reference: str
    method: str


class Study(Strict):
    """A study file, validated. Surveys are loaded: names and paths are resolved by `load_study`."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,40}$")]
    title: Sentence
    version: str = "1"
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 1
    theme: Literal["dark", "light"] = "dark"
    scene: str = "default"
    preset: str = "default"
    participants: Annotated[int, Field(ge=1, le=10000)] = 24
    """How many completed participants are wanted, for the check and the dashboard."""
    conditions: Annotated[tuple[Condition, ...], Field(min_length=1, max_length=8)]
    order: Literal["full", "williams"] = "full"
    label: Annotated[str, Field(pattern=r"^[a-z]{1,20}$")] = "method"
    rotation: bool = False
    camera: Literal["operator", "side", "top"] = "operator"
    abandoned_after_min: Annotated[float, Field(ge=1, le=10000)] = 60.0
    arrival: Arrival = Arrival()
    consent: Consent
    background: tuple[Item, ...] = ()
    device: Device = Device()
    instructions: Annotated[tuple[Sentence, ...], Field(min_length=1)]
    training: Training = Training()
    trials: Trials = Trials()
    surveys: tuple[Survey, ...] = ()
    debrief: Annotated[tuple[Sentence, ...], Field(min_length=1)]
    completion: Completion = Completion()
    exclusions: tuple[dict[str, Any], ...] = ()
    analysis: Analysis | None = None

    @property
    def labels(self) -> tuple[str, ...]:
        """What participants see: method1, method2, …, in the order they meet them."""
        return tuple(f"{self.label}{i + 1}" for i in range(len(self.conditions)))

    @model_validator(mode="after")
    def _check(self) -> Self:
        for problem in _problems(self):
            raise problem
        return self


def _problems(study: Study) -> Iterator[FieldProblem]:
    if study.preset not in PRESETS:
        yield FieldProblem(("preset",), f"{study.preset!r} is unknown; valid: {', '.join(PRESETS)}")
        return
    names = [condition.name for condition in study.conditions]
    for i, condition in enumerate(study.conditions):
        if condition.name in names[:i]:
            yield FieldProblem(("conditions", i, "name"), f"{condition.name!r} is taken")
        if condition.method not in METHODS:
            yield FieldProblem(
                ("conditions", i, "method"),
                f"{condition.method!r} is unknown; valid: {', '.join(METHODS)}",
            )
            continue
        try:
            preset(study.preset, **{**condition.settings, "method": condition.method})
        except CoreError as error:
            yield FieldProblem(("conditions", i, "settings"), str(error))
    yield from _item_problems(study)
    if study.order == "full" and len(study.conditions) > 5:
        yield FieldProblem(
            ("order",), f"'full' of {len(names)} conditions has too many rows; valid: williams"
        )
    if study.arrival.require == "code" and not study.arrival.codes:
        yield FieldProblem(("arrival", "codes"), "is empty; valid: codes for participants to type")
    if study.completion.redirect and not study.completion.redirect.startswith("https://"):
        yield FieldProblem(
            ("completion", "redirect"),
            f"{study.completion.redirect!r} is no address; valid: https://…",
        )
    if study.analysis is not None:
        for field in ("reference", "method"):
            value = getattr(study.analysis, field)
            if value not in names:
                yield FieldProblem(
                    ("analysis", field), f"{value!r} is no condition; valid: {', '.join(names)}"
                )


def _item_problems(study: Study) -> Iterator[FieldProblem]:
    seen: set[str] = set()
    for i, item in enumerate(study.background):
        if item.id in seen:
            yield FieldProblem(("background", i, "id"), f"{item.id!r} is taken")
        seen.add(item.id)
        if item.kind == "preference":
            yield FieldProblem(
                ("background", i, "kind"), "'preference' compares methods; valid: in a survey"
            )
    ids = [survey.id for survey in study.surveys]
    if len(set(ids)) < len(ids):
        yield FieldProblem(("surveys",), f"two surveys have one id: {', '.join(ids)}")
    for i, survey in enumerate(study.surveys):
        compares = any(item.kind == "preference" for s in survey.sections for item in s.items)
        if compares and len(study.conditions) != 2:
            yield FieldProblem(
                ("surveys", i),
                f"asks for a preference between 2 methods; there are {len(study.conditions)}",
            )
