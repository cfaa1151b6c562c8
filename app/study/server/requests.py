"""What a participant's page may ask for, checked field by field."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from app.study.errors import ProtocolError

MAX_BODY_BYTES = 64 * 1024


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


Name = Annotated[str, Field(max_length=80)]
At = Annotated[int, Field(ge=0, le=100000)]
Values = Annotated[dict[Name, int | float | str | None], Field(max_length=400)]


class Consent(_Strict):
    """I want to take part. `request` is the browser's own random number for this."""

    do: Literal["consent"]
    request: Annotated[str, Field(min_length=16, max_length=80)]
    agree: Literal[True]


class Code(_Strict):
    """A code that was typed."""

    do: Literal["code"]
    code: Annotated[str, Field(min_length=1, max_length=60)]


class Answer(_Strict):
    """Answers of the page at step `at`, complete or as a draft."""

    do: Literal["answer", "draft"]
    at: At
    page: Name
    values: Values


class Continue(_Strict):
    """Leave the page at step `at`."""

    do: Literal["continue"]
    at: At
    page: Name


class Back(_Strict):
    """Back to the survey before."""

    do: Literal["back"]
    at: At


class Extra(_Strict):
    """One more training trial with the method at this place."""

    do: Literal["extra"]
    at: At
    place: Annotated[int, Field(ge=0, le=20)]


class Withdraw(_Strict):
    """Leave the study."""

    do: Literal["withdraw"]


class Erase(_Strict):
    """Have all data deleted afterwards."""

    do: Literal["erase"]
    code: Annotated[str, Field(min_length=1, max_length=60)]


PageRequest = Consent | Code | Answer | Continue | Back | Extra | Withdraw | Erase
_ADAPTER: TypeAdapter[PageRequest] = TypeAdapter(Annotated[PageRequest, Field(discriminator="do")])


def parse_request(body: bytes) -> PageRequest:
    """Check a request's body.

    Raises:
        ProtocolError: Naming the field and what is valid.
    """
    try:
        return _ADAPTER.validate_json(body)
    except ValidationError as error:
        first: Any = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"]) or "request"
        raise ProtocolError(f"{where}: {first['msg']}") from None
