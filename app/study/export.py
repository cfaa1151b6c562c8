"""`hindsight study export`: the copy that may be shared.

No identities, no free text without `--with-comments`, nobody who withdrew or never finished
consenting; days instead of times, and names of browsers without their versions.
"""

import csv
import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from app.recording.folders import EVENTS_FILE, SESSION_FILE, read_events
from app.study.coarsen import copy_log
from app.study.errors import StudyError
from app.study.folder import STUDY_FILE, open_folder
from app.study.lock import lock_study
from app.study.store import Person, Store
from app.study.tables import table_path, write_tables

TIMES = ("wall_s", "created_wall_s", "started_wall_s", "ended_wall_s")
_DAY_S = 86400


@dataclass(frozen=True)
class Exported:
    """What was written.

    Attributes:
        folder: Where.
        participants: How many.
        trials: Recordings of them.
        notes: What was left out, in sentences.
    """

    folder: Path
    participants: int
    trials: int
    notes: tuple[str, ...]


def export_study(folder: Path, out: Path | None = None, *, with_comments: bool = False) -> Exported:
    """Write the shareable copy of a study's folder.

    Args:
        folder: `<sessions>/<study>`.
        out: Where to; None: `<study>-export` in the working directory.
        with_comments: Whether what participants wrote is copied, into a table of its own.

    Raises:
        StudyError: If the folder is none of a study, a server hosts it, or the copy exists already.
    """
    root = folder.resolve()
    target = (out or Path(f"{root.name}-export")).resolve()
    if target.exists() and any(target.iterdir()):
        raise StudyError(f"{target} exists and is not empty; choose another --out")
    with lock_study(root.parent, root.name):
        store = open_folder(root)
        try:
            return export_store(store, target, with_comments=with_comments)
        finally:
            store.close()


def export_store(store: Store, target: Path, *, with_comments: bool) -> Exported:
    """The same of an open store, also while it is in use."""
    root = store.root.resolve()
    write_tables(store)
    target.joinpath("data").mkdir(parents=True, exist_ok=True)
    for name in (STUDY_FILE, "README.md", "dataset_description.json"):
        shutil.copyfile(root / name, target / name)
    for what in ("participants", "trials", "survey"):
        path = table_path(store, what)
        shutil.copyfile(path, target / "data" / path.name)
    people = sorted(store.people.values(), key=lambda person: person.id)
    trials = sum(_copy_person(person, store.root, target) for person in people)
    notes = ["Times of day were left out; every trial begins at midnight of its day."]
    if with_comments:
        _write_comments(store, people, target)
        notes.append("Comments are included: read them for what could identify somebody.")
    return Exported(target, len(people), trials, tuple(notes))


def _copy_person(person: Person, root: Path, target: Path) -> int:
    """Copy one participant's session; returns how many logs."""
    place = target / person.folder.relative_to(root)
    place.mkdir(parents=True, exist_ok=True)
    about = json.loads((person.folder / SESSION_FILE).read_text(encoding="utf-8"))
    (place / SESSION_FILE).write_text(json.dumps(coarsen(about), indent=2) + "\n", "utf-8")
    lines = [coarsen(line) for line in read_events(person.folder)]
    text = b"".join(msgspec.json.encode(line) + b"\n" for line in lines)
    (place / EVENTS_FILE).write_bytes(text)
    logs = sorted(person.folder.glob("trial-*.mcap"))
    for log in logs:
        copy_log(log, place / log.name)
    return len(logs)


def coarsen(value: Any) -> Any:
    """Times of day become days (UTC), process numbers and exact machines go; all else stays."""
    if isinstance(value, dict):
        kept = {k: v for k, v in value.items() if k not in ("pid", "machine", "worker")}
        return {k: _day(v) if k in TIMES else coarsen(v) for k, v in kept.items()}
    return [coarsen(v) for v in value] if isinstance(value, list) else value


def _day(wall_s: Any) -> float:
    return float(wall_s) // _DAY_S * _DAY_S if isinstance(wall_s, int | float) else 0.0


def _write_comments(store: Store, people: list[Person], target: Path) -> None:
    path = target / "data" / f"study-{store.study.name}_description-comments_data.csv"
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("participant_id", "page", "item", "text"))
        for person in people:
            texts = store.private.read(person.id).get("texts", {})
            for page, values in texts.items():
                if page != "device":
                    writer.writerows((person.id, page, k, v) for k, v in values.items())
