"""`hindsight study rebuild`: index and tables anew from the files, which are the record."""

from pathlib import Path

from app.recording.recovery import recover_trials
from app.study.folder import open_folder
from app.study.lock import lock_study
from app.study.tables import write_tables


def rebuild(folder: Path) -> str:
    """Read every participant's files, and write index and tables; returns what was found.

    Raises:
        StudyError: If a server hosts the folder, or it cannot be used.
    """
    root = folder.resolve()
    with lock_study(root.parent, root.name):
        recover_trials(root.parent)
        store = open_folder(root)
        try:
            store.index.forget_rows()
            paths = write_tables(store)
            people = list(store.people.values())
        finally:
            store.close()
    trials = sum(len(p.state.attempts) for p in people)
    lines = [f"{len(people)} participants, {trials} attempts at trials", *map(str, paths)]
    return "\n".join(lines)
