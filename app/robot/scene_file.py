"""Reading scene files: YAML in, a valid `Scene` or an error that leads to the line at fault."""

from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from app.robot.errors import SceneError
from app.robot.objects import KINDS
from app.robot.scene import FieldProblem, Scene

SCENES = Path(__file__).with_name("scenes")
MAX_BYTES = 256 * 1024


def list_scenes() -> tuple[str, ...]:
    """Names of the scenes that come with the program; `default` is the first."""
    names = sorted(path.stem for path in SCENES.glob("*.yaml"))
    return tuple(sorted(names, key=lambda name: name != "default"))


def load_scene(name_or_path: str | Path) -> Scene:
    """Read a shipped scene by its name, or any scene file by its path.

    Raises:
        SceneError: If there is no such file, it is no YAML, or a field is bad; the message names
            file, line, field, value and what is valid.
    """
    text = str(name_or_path)
    if text in list_scenes():
        return _shipped(text)
    path = Path(name_or_path).expanduser()
    if not path.is_file():
        raise SceneError(
            f"no scene {text!r}; valid: {', '.join(list_scenes())}, or the path of a scene file"
        )
    return read_scene(path)


@lru_cache(maxsize=32)
def _shipped(name: str) -> Scene:
    return read_scene(SCENES / f"{name}.yaml")


def read_scene(path: Path) -> Scene:
    """Read and validate one scene file.

    Raises:
        SceneError: As `load_scene`.
    """
    try:
        raw = path.read_bytes()
        if len(raw) > MAX_BYTES:
            raise SceneError(f"{path}: {len(raw)} bytes; valid: at most {MAX_BYTES}")
        document = YAML(typ="rt").load(raw.decode("utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"{path}: cannot be read: {error}") from error
    except MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise SceneError(f"{path}, line {line}: not valid YAML: {error.problem}") from error
    except (YAMLError, ValueError, RecursionError) as error:
        raise SceneError(f"{path}: not valid YAML: {error}") from error
    if not isinstance(document, dict):
        raise SceneError(f"{path}, line 1: not a scene; valid: fields {_fields(Scene)}")
    try:
        return Scene.model_validate(document)
    except ValidationError as error:
        lines = [_describe(path, document, dict(item)) for item in error.errors()]
        raise SceneError("\n".join(lines)) from error


def _describe(path: Path, document: Any, error: dict[str, Any]) -> str:
    """One line for one problem: file, line, field: value; what is valid."""
    cause = error.get("ctx", {}).get("error")
    where = cause.where if isinstance(cause, FieldProblem) else _without_tags(error["loc"])
    line, value = _locate(document, where)
    field = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in where).lstrip(".")
    head = f"{path}, line {line}, {field or 'scene'}"
    if isinstance(cause, FieldProblem):
        return f"{head}: {cause}"
    return f"{head}: {_explain(error, value)}"


def _explain(error: dict[str, Any], value: Any) -> str:
    """The problem in words that name the value and the valid ones."""
    context = error.get("ctx", {})
    match error["type"]:
        case "missing":
            return "is missing; valid: a value for this field"
        case "extra_forbidden":
            return "is no field of a scene here; valid: remove it or mend its name (docs/scenes.md)"
        case "union_tag_invalid" | "union_tag_not_found":
            kind = value.get("kind") if isinstance(value, dict) else value
            return f"kind {kind!r} is unknown; valid: {', '.join(KINDS)}"
        case "literal_error":
            return f"{value!r} is unknown; valid: {context['expected']}"
        case "greater_than_equal":
            return f"{value!r} is too small; valid: at least {context['ge']:g}"
        case "less_than_equal":
            return f"{value!r} is too large; valid: at most {context['le']:g}"
        case "string_pattern_mismatch":
            return f"{value!r} is no name; valid: {context['pattern']}"
    shown = "" if isinstance(value, dict | list) else f"{value!r}: "
    return f"{shown}{error['msg']}"


def _without_tags(where: tuple[str | int, ...]) -> tuple[str | int, ...]:
    """Pydantic puts an object's kind into the way to its fields; the file has no such level."""
    if len(where) > 2 and where[0] == "objects" and where[2] in KINDS:
        return (*where[:2], *where[3:])
    return where


def _locate(document: Any, where: tuple[str | int, ...]) -> tuple[int, Any]:
    """Line (from 1) and value of a field; the nearest line above where the field is missing."""
    node, line = document, document.lc.line + 1
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


def _fields(model: type[Scene]) -> str:
    return ", ".join(model.model_fields)
