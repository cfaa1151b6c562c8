"""The reviewed folder: its trials by id, and no way out of it.

A trial's id is the path of its log below the folder, with slashes: readable in links and stable.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from app.recording.folders import PRIVATE
from app.recording.numbering import FINISHED, UNFINISHED
from app.recording.store import TrialEntry, entry_of
from app.review.errors import MissingError, OutsideError, ReviewError

_ENDINGS = (FINISHED, UNFINISHED)


@dataclass(frozen=True, slots=True)
class Listed:
    """One log of the folder.

    Attributes:
        id: Its path below the folder.
        path: Where it is.
        state: Size [byte] and time of change [ns].
        entry: What it says of itself.
    """

    id: str
    path: Path
    state: tuple[int, int]
    entry: TrialEntry


class ReviewFolder:
    """Any folder that holds logs: all sessions, one study, or a single session.

    Attributes:
        root: The folder, resolved.
    """

    def __init__(self, root: Path | str) -> None:
        """Take a folder.

        Raises:
            ReviewError: If it is no folder.
        """
        self.root = Path(root).resolve()
        if not self.root.is_dir():
            raise ReviewError(f"there is no folder of sessions at {root}")
        self._known: dict[Path, Listed] = {}

    def scan(self) -> list[Listed]:
        """All logs, usable or not, by study, participant, session and trial.

        A log is opened again only where it has changed, so that scanning may be frequent.
        """
        known: dict[Path, Listed] = {}
        for path in self._logs():
            try:
                stat = path.stat()
            except OSError:
                continue  # recovered or renamed meanwhile
            state = (stat.st_size, stat.st_mtime_ns)
            before = self._known.get(path)
            # Whether an unfinished log is still written does not show in its state.
            if before is not None and before.state == state and path.name.endswith(FINISHED):
                known[path] = before
            else:
                known[path] = Listed(self.id_of(path), path, state, entry_of(path))
        self._known = known
        return sorted(known.values(), key=_order)

    def id_of(self, path: Path) -> str:
        """The id of a log of this folder."""
        return path.relative_to(self.root).as_posix()

    def path_of(self, trial_id: str) -> Path:
        """The log with this id.

        Raises:
            OutsideError: If the id leads out of the folder, by its parts or by a link.
            MissingError: If there is no such log.
        """
        parts = trial_id.split("/")
        if "\0" in trial_id or "\\" in trial_id or not trial_id or {"", ".", ".."} & set(parts):
            raise OutsideError(f"{trial_id!r} is no trial's id; valid: a path below the folder")
        path = self.root.joinpath(*parts)
        if PRIVATE in parts or not path.resolve().is_relative_to(self.root):
            raise OutsideError(f"{trial_id!r} lies outside the reviewed folder")
        if not path.name.endswith(_ENDINGS) or not path.is_file():
            raise MissingError(f"there is no trial {trial_id!r} in the reviewed folder")
        return path

    def finished(self, trial_id: str) -> Path:
        """The same for a trial that can be opened.

        Raises:
            ReviewError: As `path_of`, or if the log is not finished.
        """
        path = self.path_of(trial_id)
        if not path.name.endswith(FINISHED):
            entry = entry_of(path)
            why = entry.problem or f"{trial_id} is {entry.outcome}: its log is not finished"
            raise ReviewError(why)
        return path

    def _logs(self) -> Iterator[Path]:
        for folder, folders, files in os.walk(self.root):
            folders[:] = sorted(n for n in folders if n != PRIVATE and not n.startswith("."))
            for name in files:
                if name.endswith(_ENDINGS) and not name.startswith("."):
                    path = Path(folder) / name
                    if not path.is_symlink():
                        yield path


def _order(listed: Listed) -> tuple[str, str, str, int, str]:
    entry = listed.entry
    return entry.study, entry.participant, entry.session, entry.trial, listed.id
