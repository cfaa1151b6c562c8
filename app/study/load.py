"""Finding and reading study files, with the surveys they name."""

from pathlib import Path
from typing import Any

from app.errors import AppError
from app.robot.scene_file import load_scene
from app.study.errors import StudyError
from app.study.items import Survey
from app.study.schema import Study
from app.study.yaml_file import complain, read_document, read_model, validate

HERE = Path(__file__).parent
SURVEYS = HERE / "surveys"


def list_studies() -> tuple[str, ...]:
    """Names of the studies that come with the program."""
    return tuple(sorted(path.stem for path in HERE.glob("*.yaml")))


def list_surveys() -> tuple[str, ...]:
    """Names of the surveys that come with the program."""
    return tuple(sorted(path.stem for path in SURVEYS.glob("*.yaml")))


def load_study(name_or_path: str | Path) -> Study:
    """Read a shipped study by its name, or any study file by its path.

    Raises:
        StudyError: Naming file, line, field, value and what is valid.
    """
    return read_study(study_path(name_or_path))


def study_path(name_or_path: str | Path) -> Path:
    """Where a study file is.

    Raises:
        StudyError: If there is none.
    """
    text = str(name_or_path)
    path = Path(name_or_path).expanduser()
    for shipped in (text, text.removesuffix(".yaml")):
        if not path.is_file() and shipped in list_studies():
            return HERE / f"{shipped}.yaml"
    if not path.is_file():
        raise StudyError(
            f"no study {text!r}; valid: {', '.join(list_studies())}, or the path of a study file"
        )
    return path


def read_study(path: Path) -> Study:
    """Read and validate one study file; errors as `load_study`."""
    document = read_document(path)
    surveys = document.get("surveys")
    if isinstance(surveys, list):
        for i, entry in enumerate(surveys):
            if isinstance(entry, str):
                surveys[i] = _survey(path, document, i, entry)
    study = validate(path, document, Study)
    try:
        load_scene(_beside(path, study.scene))
    except AppError as error:
        raise complain(path, document, ("scene",), str(error)) from None
    return study.model_copy(update={"scene": _beside(path, study.scene)})


def _survey(path: Path, document: Any, index: int, entry: str) -> Survey:
    """A survey by its shipped name or its path."""
    if entry in list_surveys():
        return read_model(SURVEYS / f"{entry}.yaml", Survey)
    beside = Path(_beside(path, entry))
    if beside.is_file():
        return read_model(beside, Survey)
    raise complain(
        path,
        document,
        ("surveys", index),
        f"{entry!r} is no survey; valid: {', '.join(list_surveys())}, the path of a survey file, "
        "or a survey written out here",
    )


def _beside(path: Path, text: str) -> str:
    """A path is meant from the study file's folder."""
    candidate = path.parent / text
    return str(candidate) if text.endswith((".yaml", ".yml")) and candidate.is_file() else text
