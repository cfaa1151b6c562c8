"""`hindsight verify`: do recorded trials repeat, bit for bit, and where or why not."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from app.errors import AppError
from app.recording.entry import TrialEntry
from app.recording.listing import entry_of, read_header
from app.recording.log_file import iter_steps
from app.recording.numbering import FINISHED
from app.review.errors import ReviewError
from app.review.folder import ReviewFolder
from app.session.verify import VerifyError, resimulate

Verdict = Literal["identical", "diverges", "cannot try"]


@dataclass(frozen=True, slots=True)
class Finding:
    """What became of one log.

    Attributes:
        name: Of the log, below the folder that was given.
        verdict: identical: every state repeats. diverges: from a step on it does not.
        detail: Where it diverges, or why it cannot be tried.
        steps: Steps of the trial.
    """

    name: str
    verdict: Verdict
    detail: str
    steps: int = 0


def verify(target: Path) -> Iterator[Finding]:
    """Re-simulate a log, or all logs of a folder, one after another.

    Raises:
        ReviewError: If there is no such file or folder.
    """
    if target.is_file():
        yield verify_log(target, target.name)
        return
    folder = ReviewFolder(target)
    for listed in folder.scan():
        yield verify_log(listed.path, listed.id, listed.entry)


def verify_log(path: Path, name: str, entry: TrialEntry | None = None) -> Finding:
    """Re-simulate one log; what is wrong with it is the finding, never an exception."""
    entry = entry_of(path) if entry is None else entry
    if entry.problem:
        return Finding(name, "cannot try", _of_it(entry.problem, path))
    if not path.name.endswith(FINISHED):
        return Finding(name, "cannot try", f"it is {entry.outcome}: its log is not finished")
    try:
        header = read_header(path)
        if header is None:
            raise ReviewError("it holds no trial")
        difference = resimulate(header, iter_steps(path))
    except VerifyError as error:
        return Finding(name, "cannot try", str(error), entry.steps)
    except AppError as error:
        return Finding(name, "cannot try", _of_it(str(error), path), entry.steps)
    except (ValueError, IndexError) as error:  # a log whose numbers do not fit its own scene
        return Finding(name, "cannot try", f"its numbers do not fit its scene: {error}")
    if difference is None:
        return Finding(name, "identical", "", entry.steps)
    return Finding(name, "diverges", str(difference), entry.steps)


def _of_it(error: str, path: Path) -> str:
    """What is wrong with a log whose name stands before it anyway."""
    return error.removeprefix(f"{path}: ").replace(str(path), "it")


def format_finding(finding: Finding) -> str:
    """One line for the terminal."""
    if finding.verdict == "identical":
        return f"{finding.name}: identical ({finding.steps} steps)"
    joint = " at " if finding.verdict == "diverges" else ": "
    return f"{finding.name}: {finding.verdict}{joint}{finding.detail}"


def run(target: Path) -> int:
    """Print what is found; 0 where all is identical, 1 where a log diverges or cannot be tried."""
    counts: dict[str, int] = {"identical": 0, "diverges": 0, "cannot try": 0}
    for finding in verify(target):
        counts[finding.verdict] += 1
        print(format_finding(finding), flush=True)
    if sum(counts.values()) == 0:
        print(f"no logs in {target}")
    elif sum(counts.values()) > 1:
        print(", ".join(f"{number} {verdict}" for verdict, number in counts.items() if number))
    return 0 if counts["diverges"] + counts["cannot try"] == 0 else 1
