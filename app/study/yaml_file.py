"""YAML in, a validated model or an error that leads to file, line, field and valid values."""

from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from app.study.errors import StudyError

MAX_BYTES = 256 * 1024
Model = TypeVar("Model", bound=BaseModel)


class FieldProblem(ValueError):
    """A problem between fields; `where` leads to the field at fault."""

    def __init__(self, where: tuple[str | int, ...], text: str) -> None:
        super().__init__(text)
        self.where = where


def read_model(path: Path, model: type[Model]) -> Model:
    """Read and validate one file.

    Raises:
        StudyError: One line per problem: file, line, field, value, what is valid.
    """
    return validate(path, read_document(path), model)


def read_document(path: Path) -> Any:
    """The file's mapping, with the line of every field.

    Raises:
        StudyError: If it cannot be read or is no mapping.
    """
    try:
        raw = path.read_bytes()
        if len(raw) > MAX_BYTES:
            raise StudyError(f"{path}: {len(raw)} bytes; valid: at most {MAX_BYTES}")
        document = YAML(typ="rt").load(raw.decode("utf-8"))
    except OSError as error:
        raise StudyError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise StudyError(f"{path}: cannot be read: {error}") from None
    except MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise StudyError(f"{path}, line {line}: not valid YAML: {error.problem}") from None
    except (YAMLError, ValueError, RecursionError) as error:
        raise StudyError(f"{path}: not valid YAML: {error}") from None
    if not isinstance(document, dict):
        raise StudyError(f"{path}, line 1: no mapping of fields; see docs/study.md")
    return document


def validate(path: Path, document: Any, model: type[Model]) -> Model:
    """Validate what `read_document` returned; errors as `read_model`."""
    try:
        return model.model_validate(document)
    except ValidationError as error:
        lines = [_describe(path, document, dict(item), model) for item in error.errors()]
        raise StudyError("\n".join(dict.fromkeys(lines))) from None


def complain(path: Path, document: Any, where: tuple[str | int, ...], text: str) -> StudyError:
    """The error for a problem found after validation, with the line of its field."""
    line, _ = _locate(document, where)
    return StudyError(f"{path}, line {line}, {_dotted(where)}: {text}")


def _describe(path: Path, document: Any, error: dict[str, Any], model: type[BaseModel]) -> str:
    cause = error.get("ctx", {}).get("error")
    where = cause.where if isinstance(cause, FieldProblem) else _present(document, error["loc"])
    line, value = _locate(document, where)
    head = f"{path}, line {line}, {_dotted(where)}"
    if isinstance(cause, FieldProblem):
        return f"{head}: {cause}"
    return f"{head}: {_explain(error, value, model)}"


def _explain(error: dict[str, Any], value: Any, model: type[BaseModel]) -> str:
    context = error.get("ctx", {})
    match error["type"]:
        case "missing":
            return "is missing; valid: a value for this field"
        case "extra_forbidden":
            known = f" ({', '.join(model.model_fields)})" if len(error["loc"]) == 1 else ""
            return f"is no field here; valid: remove it or mend its name{known}"
        case "union_tag_invalid" | "union_tag_not_found":
            expected = context.get("expected_tags", "likert, preference, choice, number, text")
            return f"kind is not known; valid: {expected}"
        case "literal_error":
            return f"{value!r} is unknown; valid: {context['expected']}"
        case "greater_than_equal":
            return f"{value!r} is too small; valid: at least {context['ge']:g}"
        case "less_than_equal":
            return f"{value!r} is too large; valid: at most {context['le']:g}"
        case "string_pattern_mismatch":
            return f"{value!r} does not fit; valid: {context['pattern']}"
    shown = "" if isinstance(value, dict | list) else f"{value!r}: "
    return f"{shown}{error['msg']}"


def _present(document: Any, where: tuple[str | int, ...]) -> tuple[str | int, ...]:
    """The way without the tags of unions, which the file has no level for."""
    way: list[str | int] = []
    node = document
    for i, key in enumerate(where):
        try:
            node = node[key]
        except (KeyError, IndexError, TypeError):
            if i < len(where) - 1:
                continue
        way.append(key)
    return tuple(way)


def _locate(document: Any, where: tuple[str | int, ...]) -> tuple[int, Any]:
    """Line (from 1) and value of a field; the nearest line above where the field is missing."""
    node = document
    line = document.lc.line + 1 if hasattr(document, "lc") else 1
    for key in where:
        marks = getattr(node, "lc", None)
        try:
            position = None if marks is None else marks.data[key]
            node = node[key]
        except (KeyError, IndexError, TypeError):
            return line, None
        if position is not None:
            line = position[0] + 1
    return line, node


def _dotted(where: tuple[str | int, ...]) -> str:
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in where)
    return text.lstrip(".") or "the file"
