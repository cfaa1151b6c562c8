"""Questions: what a survey or a background page asks, and which answers are valid."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.study.errors import AnswerError

ItemName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,31}$")]
Sentence = Annotated[str, Field(min_length=1, max_length=4000)]


class Strict(BaseModel):
    """Frozen, finite, and without fields nobody knows."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class ItemBase(Strict):
    """What every question has."""

    id: ItemName
    text: Sentence
    required: bool = True


class Likert(ItemBase):
    """A row of numbered radios; nothing is preselected."""

    kind: Literal["likert"]
    points: Annotated[int, Field(ge=2, le=21)] = 7
    low: str = "strongly disagree"
    high: str = "strongly agree"
    middle: str = ""


class Preference(ItemBase):
    """From the first method shown to the second; stored from the study's first to its second."""

    kind: Literal["preference"]
    points: Annotated[int, Field(ge=3, le=11)] = 7
    middle: str = "no preference"


class Choice(ItemBase):
    """One of several answers; `eligible` names those with which one may take part."""

    kind: Literal["choice"]
    options: Annotated[dict[str, str], Field(min_length=2, max_length=30)]
    eligible: tuple[str, ...] = ()


class Number(ItemBase):
    """A number within limits."""

    kind: Literal["number"]
    low: float = 0.0
    high: float = 1e6
    unit: str = ""


class Text(ItemBase):
    """Free text: personal data, kept apart in `private/`."""

    kind: Literal["text"]
    max_length: Annotated[int, Field(ge=1, le=20000)] = 4000
    required: bool = False


Item = Annotated[Likert | Preference | Choice | Number | Text, Field(discriminator="kind")]
AnyItem = Likert | Preference | Choice | Number | Text


class Section(Strict):
    """Questions on one card: once, or once for every method."""

    per: Literal["method", "study"] = "study"
    title: str = ""
    items: Annotated[tuple[Item, ...], Field(min_length=1, max_length=60)]


class Survey(Strict):
    """A survey file."""

    id: ItemName
    title: Sentence
    lead: str = ""
    sections: Annotated[tuple[Section, ...], Field(min_length=1, max_length=20)]


def key_of(section: Section, item: AnyItem, label: str) -> str:
    """Name of an answer: the item's, with the method's label in front where asked per method."""
    return f"{label}/{item.id}" if section.per == "method" else item.id


def survey_items(survey: Survey, labels: Sequence[str]) -> dict[str, AnyItem]:
    """All answers a survey asks for, in order."""
    found: dict[str, AnyItem] = {}
    for section in survey.sections:
        for label in labels if section.per == "method" else ("",):
            found |= {key_of(section, item, label): item for item in section.items}
    return found


def check_answers(
    items: Mapping[str, AnyItem], values: Mapping[str, Any], *, partial: bool = False
) -> dict[str, Any]:
    """The valid answers, in the order of the items.

    Args:
        items: As `survey_items` names them.
        values: As the page sent them.
        partial: Whether required answers may still be missing (a draft).

    Raises:
        AnswerError: Naming each item and what is valid.
    """
    problems = {name: "no such question" for name in values if name not in items}
    answers: dict[str, Any] = {}
    for name, item in items.items():
        value = values.get(name)
        if value is None or value == "":
            if item.required and not partial:
                problems[name] = "is not answered"
            continue
        problem = _problem(item, value)
        if problem:
            problems[name] = problem
        else:
            answers[name] = value
    if problems:
        raise AnswerError(problems)
    return answers


def ineligible(items: Mapping[str, AnyItem], answers: Mapping[str, Any]) -> str:
    """Why these answers rule out taking part; empty where they do not."""
    for name, item in items.items():
        if isinstance(item, Choice) and item.eligible and name in answers:
            if answers[name] not in item.eligible:
                return f"{name} is {answers[name]}"
    return ""


def _problem(item: AnyItem, value: Any) -> str:
    if isinstance(item, Likert | Preference):
        valid = type(value) is int and 1 <= value <= item.points
        return "" if valid else f"{value!r}; valid: 1 to {item.points}"
    if isinstance(item, Choice):
        valid = isinstance(value, str) and value in item.options
        return "" if valid else f"{value!r}; valid: {', '.join(item.options)}"
    if isinstance(item, Number):
        number = isinstance(value, int | float) and not isinstance(value, bool)
        valid = number and item.low <= value <= item.high
        return "" if valid else f"{value!r}; valid: {item.low:g} to {item.high:g}"
    valid = isinstance(value, str) and len(value) <= item.max_length
    return "" if valid else f"valid: text of at most {item.max_length} characters"
