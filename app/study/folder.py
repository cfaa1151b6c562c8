"""From a study's folder back to its store: for export and rebuild."""

from pathlib import Path

from app.recording.folders import read_events
from app.study.errors import StudyError
from app.study.events import Consented, from_line
from app.study.load import read_study
from app.study.store import SESSION, Store

STUDY_FILE = "study.yaml"


def open_folder(folder: Path) -> Store:
    """The store of a study's folder, `<sessions>/<study>`.

    Raises:
        StudyError: If it is no study's folder.
    """
    path = folder / STUDY_FILE
    if not path.is_file():
        raise StudyError(f"{folder} is no folder of a hosted study: it has no {STUDY_FILE}")
    study = read_study(path)
    if folder.resolve().name != study.name:
        raise StudyError(f"{folder}: the study file says {study.name!r}; valid: that folder name")
    return Store(study, folder.resolve().parent, test=_is_test(folder))


def _is_test(folder: Path) -> bool:
    for session in sorted(folder.glob(f"data/raw/subject-*/session-{SESSION}")):
        for line in read_events(session):
            event = from_line(line)
            if isinstance(event, Consented):
                return event.test
    return False
