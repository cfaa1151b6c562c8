"""The messages of a log: their JSON, their JSON schemas, and the version check."""

import functools
import math
import typing
from typing import Any, TypeVar

import msgspec

from app.recording.errors import MessageError, NewerFormatError
from app.recording.fields import RECORDS, element_type, fields
from app.recording.schema import TrialHeader

SCHEMA_VERSION = msgspec.structs.fields(TrialHeader)[0].default
"""Newest record format this program reads and the one it writes."""


def _encode_foreign(value: Any) -> Any:
    """NumPy's numbers and arrays as Python's: nobody's log should fail for a missing `float()`."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no place in a log")


encode = msgspec.json.Encoder(enc_hook=_encode_foreign).encode
"""Struct → JSON; float64 keep every bit, a number that is not finite becomes null."""

Struct = TypeVar("Struct", bound=msgspec.Struct)

_JSON_TYPES = {str: "string", int: "integer", float: "number", bool: "boolean"}


class _Version(msgspec.Struct):
    schema_version: int = 1


@functools.cache
def _decoder(kind: type[msgspec.Struct]) -> msgspec.json.Decoder[Any]:
    return msgspec.json.Decoder(kind)


def decode(kind: type[Struct], data: bytes) -> Struct:
    """JSON → struct; null stands for a number that was not finite and comes back as NaN.

    Raises:
        MessageError: If the JSON is broken, lacks a field or holds one of another type.
    """
    try:
        return _decoder(kind).decode(data)
    except msgspec.ValidationError as error:
        # The control loop promises finite numbers; where it broke that promise the log is the
        # evidence, so it stays readable.
        if b"null" not in data:
            raise MessageError(f"bad {kind.__name__} message: {error}") from None
    except (ValueError, RecursionError) as error:
        raise MessageError(f"bad {kind.__name__} message: {error}") from None
    try:
        return msgspec.convert(_nulls_to_nan(msgspec.json.decode(data)), kind)
    except ValueError as error:
        raise MessageError(f"bad {kind.__name__} message: {error}") from None


def _nulls_to_nan(value: Any) -> Any:
    if value is None:
        return math.nan
    if isinstance(value, list):
        return [_nulls_to_nan(item) for item in value]
    if isinstance(value, dict):
        return {key: _nulls_to_nan(item) for key, item in value.items()}
    return value


def decode_header(data: bytes) -> TrialHeader:
    """The header of a log, refused where a newer program wrote it.

    Raises:
        NewerFormatError: If the version is newer than this program's.
        MessageError: If the message is bad.
    """
    version = decode(_Version, data).schema_version
    if version > SCHEMA_VERSION:
        raise NewerFormatError(
            f"it was written in record format {version}; this program reads up to "
            f"{SCHEMA_VERSION}: update Hindsight"
        )
    return decode(TrialHeader, data)


@functools.cache
def json_schema(record: str) -> bytes:
    """JSON schema of a record's message, flat: no $ref, anyOf or prefixItems.

    Viewers of robot logs reject those three, so the schema is spelled out from the struct rather
    than taken from msgspec.
    """
    infos = msgspec.structs.fields(RECORDS[record])
    lines = {line.name: line for line in fields(record)}
    properties: dict[str, Any] = {}
    for info in infos:
        kind, is_list = element_type(info.type)
        entry: dict[str, Any] = {"type": _JSON_TYPES[kind]}
        if typing.get_origin(info.type) is typing.Literal:
            entry["enum"] = list(typing.get_args(info.type))
        if is_list:
            entry = {"type": "array", "items": entry}
        line = lines[info.name]
        notes = {"unit": line.unit, "frame": line.frame, "shape": line.shape}
        entry["description"] = line.description
        entry.update({name: text for name, text in notes.items() if text})
        properties[info.name] = entry
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"hindsight.{record}",
        "type": "object",
        "properties": properties,
        "required": [info.name for info in infos if info.required],
    }
    return msgspec.json.encode(schema)
