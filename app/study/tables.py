"""The tidy tables of a study's folder (docs/data.md), and what describes them.

Written whole and put into place atomically; they hold nothing that the files beside them do not.
"""

import csv
import io
import json
import os
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from app import __version__
from app.study.errors import StorageError
from app.study.items import Preference, Text, survey_items
from app.study.rows import TRIAL_COLUMNS, trial_rows
from app.study.store import Person, Store

SURVEY_COLUMNS = ("participant_id", "survey", "shown_as", "method", "item", "value")
_PERSON_COLUMNS = ("participant_id", "cell", "order", "status", "excluded_by")
_OWN = ("gender", "experience", "prior_exposure")


def write_tables(store: Store) -> list[Path]:
    """Write all three tables and the description; returns their paths.

    Raises:
        StorageError: If one of them cannot be written; the old ones stay.
    """
    people = sorted(store.people.values(), key=lambda p: p.id)
    columns = person_columns(store)
    texts = {
        table_path(store, "participants"): _csv(columns, [_person(store, p) for p in people]),
        table_path(store, "trials"): _csv(
            TRIAL_COLUMNS, [row for p in people for row in trial_rows(store, p)]
        ),
        table_path(store, "survey"): _csv(
            SURVEY_COLUMNS, [row for p in people for row in survey_rows(store, p)]
        ),
        store.root / "dataset_description.json": _description(store, columns),
        store.root / "README.md": _readme(store),
    }
    for path, text in texts.items():
        _replace(path, text)
    return list(texts)


def table_path(store: Store, what: str) -> Path:
    """A table by its name in Psych-DS: pairs of keyword and value, then `data`."""
    return store.root / "data" / f"study-{store.study.name}_description-{what}_data.csv"


def person_columns(store: Store) -> list[str]:
    """Columns of the participants table: those of docs/data.md, then the study's own items."""
    asked = [item.id for item in store.study.background if not isinstance(item, Text)]
    own = [*_OWN, *(name for name in asked if name not in _OWN)]
    return [*_PERSON_COLUMNS, *own, "device", "consent_version", "fast"]


def survey_rows(store: Store, person: Person) -> list[dict[str, Any]]:
    """Answers of one participant, but free text; a preference runs by the study's order."""
    study, plan = store.study, person.state.plan
    rows = []
    for survey in study.surveys:
        answers = person.state.answers.get(survey.id, {})
        for key, item in survey_items(survey, plan.labels).items():
            if key not in answers or isinstance(item, Text):
                continue
            label, _, _ = key.rpartition("/")
            value = answers[key]
            if isinstance(item, Preference) and plan.order[0] != study.conditions[0].name:
                value = item.points + 1 - value
            rows.append(
                {
                    "participant_id": person.id,
                    "survey": survey.id,
                    "shown_as": label,
                    "method": plan.order[plan.labels.index(label)] if label else "",
                    "item": item.id,
                    "value": value,
                }
            )
    return rows


def _person(store: Store, person: Person) -> dict[str, Any]:
    state, consent = person.state, person.consent
    status = state.status
    if status == "completed" and consent.pilot:
        status = "pilot"
    asked = {
        item.id: state.answers.get("background", {}).get(item.id, "")
        for item in store.study.background
        if not isinstance(item, Text)
    }
    return {
        **asked,
        "participant_id": person.id,
        "cell": consent.cell + 1,
        "order": ">".join(state.plan.order),
        "status": status,
        "excluded_by": state.why,
        "device": state.answers.get("device", {}).get("input", ""),
        "consent_version": consent.version,
        "fast": consent.fast,
    }


def copy_study_file(store: Store, source: Path) -> None:
    """Keep the study file beside its data: `hindsight analyze` reads exclusions from it."""
    target = store.root / "study.yaml"
    if source.resolve() != target.resolve():
        shutil.copyfile(source, target)


def _csv(columns: Sequence[str], rows: Iterable[dict[str, Any]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow([_cell(row.get(name)) for name in columns])
    return text.getvalue()


def _cell(value: Any) -> Any:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:.9g}" if isinstance(value, float) else value


def _description(store: Store, columns: Sequence[str]) -> str:
    study = store.study
    names = dict.fromkeys([*columns, *TRIAL_COLUMNS, *SURVEY_COLUMNS])
    about = {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": study.name,
        "description": ("TEST DATA of a test run, no participants. " if store.test else "")
        + study.title,
        "version": study.version,
        "creator": f"Hindsight {__version__}",
        "variableMeasured": list(names),
    }
    return json.dumps(about, indent=2) + "\n"


def _readme(store: Store) -> str:
    marked = "**Test data: nobody took part.**\n\n" if store.test else ""
    return (
        f"# {store.study.title}\n\n{marked}"
        "`data/` holds three tables, described in docs/data.md of Hindsight; `data/raw/` holds a "
        "folder for each participant with the course of the session (`events.jsonl`) and the log "
        "of every trial (MCAP). `study.yaml` is the study file. What identifies people is not "
        "here.\n"
    )


def _replace(path: Path, text: str) -> None:
    temporary = path.with_name(f".{path.name}.new")
    try:
        with temporary.open("w", encoding="utf-8", newline="") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        raise StorageError(f"cannot write {path}: {error.strerror}") from None
