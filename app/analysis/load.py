"""Read a folder: a study's (Psych-DS), a simulated run's, or one that holds only logs."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from app.analysis.errors import AnalysisError
from app.analysis.frames import Frame, pd
from app.analysis.from_logs import find_logs, rows_from_logs
from app.analysis.tables import (
    StudyData,
    clean_participants,
    clean_survey,
    clean_trials,
    read_table,
)

Progress = Callable[[str], None]


def load(folder: Path, progress: Progress) -> StudyData:
    """Everything the folder holds, typed, with notes on what is missing.

    Raises:
        AnalysisError: If there is no folder, or nothing in it that could be analysed.
    """
    if not folder.is_dir():
        raise AnalysisError(f"{folder} is no folder")
    notes: list[str] = []
    tables = _study_tables(folder)
    if (folder / "trials.parquet").is_file():
        kind, raw, source = "simulated run", _read_parquet(folder), "trials.parquet"
    elif "trials" in tables:
        kind, source = "study", tables["trials"].name
        raw = read_table(tables["trials"], notes)
    else:
        raw, kind, source = pd.DataFrame(), "sessions", "the logs"
    if raw.empty and find_logs(folder):
        if kind == "study":
            notes.append(f"{source} has no rows: the trials were derived from the logs instead.")
            source = "the logs"
        raw = rows_from_logs(folder, notes, progress)
    if raw.empty:
        raise AnalysisError(
            f"{folder} holds no trials: neither …trials_data.csv with rows (a study), nor "
            "trials.parquet (a simulated run), nor logs (trial-001.mcap)"
        )
    trials = clean_trials(raw, source, notes)
    people = read_table(tables["participants"], notes) if "participants" in tables else None
    if kind == "study" and people is None:
        notes.append("There is no participants table: participants are those who have trials.")
    answers = read_table(tables["survey"], notes) if "survey" in tables else pd.DataFrame()
    rules, contrast = _study_file(folder)
    return StudyData(
        folder=folder,
        name=_study_name(folder, trials),
        kind=kind,
        trials=trials,
        participants=clean_participants(
            pd.DataFrame() if people is None else people, trials["participant_id"], notes
        ),
        survey=clean_survey(answers, notes),
        rules=rules,
        contrast=contrast,
        notes=tuple(notes),
        calibration=_calibration(folder, notes),
    )


def _study_tables(folder: Path) -> dict[str, Path]:
    """Tables of a Psych-DS folder by what they hold; two of a kind cannot be told apart."""
    found: dict[str, Path] = {}
    for place in (folder / "data", folder):
        for what in ("participants", "trials", "survey"):
            matches = sorted(place.glob(f"*{what}_data.csv"))
            if len(matches) > 1:
                names = ", ".join(path.name for path in matches)
                raise AnalysisError(f"{place} holds several tables of {what}: {names}")
            if matches and what not in found:
                found[what] = matches[0]
    return found


def _read_parquet(folder: Path) -> Frame:
    path = folder / "trials.parquet"
    try:
        return pd.read_parquet(path)
    except (OSError, ValueError) as error:  # pyarrow's errors derive from these
        raise AnalysisError(f"{path} cannot be read ({error}); was the run interrupted?") from None


def _study_file(folder: Path) -> tuple[tuple[dict[str, Any], ...], tuple[str, str] | None]:
    """Exclusion rules and contrast of study.yaml: `exclusions`, `analysis: {reference, method}`."""
    path = next((p for p in (folder / "study.yaml", folder / "STUDY.yaml") if p.is_file()), None)
    if path is None:
        return (), None
    try:
        document = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeError, YAMLError) as error:
        raise AnalysisError(f"{path} cannot be read: {error}") from None
    document = document if isinstance(document, dict) else {}
    rules = document.get("exclusions") or []
    if isinstance(rules, dict):
        rules = [{name: value} for name, value in rules.items()]
    if not isinstance(rules, list) or not all(isinstance(rule, dict) for rule in rules):
        raise AnalysisError(
            f"{path}: exclusions must be a list of rules such as '- max_failed: 3', not {rules!r}"
        )
    analysis = document.get("analysis") or {}
    if isinstance(analysis, dict) and {"reference", "method"} <= set(analysis):
        return tuple(rules), (str(analysis["reference"]), str(analysis["method"]))
    return tuple(rules), None


def _study_name(folder: Path, trials: Frame) -> str:
    description = folder / "dataset_description.json"
    if description.is_file():
        try:
            named = json.loads(description.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            named = None
        if isinstance(named, dict) and named.get("name"):
            return str(named["name"])
    names = [s for s in trials.get("study", pd.Series(dtype=str)).dropna().unique() if s]
    return str(names[0]) if len(names) == 1 else folder.resolve().name


def _calibration(folder: Path, notes: list[str]) -> Frame | None:
    """Counts a simulated run leaves beside its rows (docs/data.md, calibration)."""
    path = folder / "calibration.csv"
    if not path.is_file():
        return None
    columns = ("method", "low", "high", "count", "probability_sum", "hits")
    table = read_table(path, notes)
    if not set(columns) <= set(table.columns):
        notes.append(f"calibration.csv lacks one of {', '.join(columns)} and was left out.")
        return None
    numbers = table[list(columns[1:])].apply(pd.to_numeric, errors="coerce")
    return table[["method"]].join(numbers).dropna().reset_index(drop=True)
