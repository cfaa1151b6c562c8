"""`hindsight simulate`: from its arguments to tables, JSON and a folder."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from app.simulate.errors import SimulateError
from app.simulate.plan import make_study
from app.simulate.report import ProgressLine, format_summary
from app.simulate.study import run_study
from app.simulate.summary import summarise


def simulate(options: Mapping[str, Any], *, workers: int, out: Path | None, to: str | None) -> int:
    """Run a study and say what came out.

    Args:
        options: Of `make_study`.
        workers: Processes; 0: every core.
        out: Folder of the run, or None.
        to: File for the summary as JSON; "-": standard output; None: a table instead.

    Returns:
        The exit code: 0, or 130 where it was interrupted.

    Raises:
        SimulateError: If something is not possible, or could not be written.
    """
    study = make_study(**options)
    run = run_study(study, workers=workers, out=out, progress=ProgressLine())
    summary = summarise(study, run.rows)
    text = json.dumps(summary, indent=2, allow_nan=False)
    if to == "-":
        print(text)
    else:
        print(format_summary(summary))
    if to not in (None, "-"):
        try:
            Path(to).write_text(text + "\n", encoding="utf-8")
        except OSError as error:
            raise SimulateError(f"{to} cannot be written: {error.strerror}") from None
    if run.problem:
        raise SimulateError(run.problem)
    if not run.complete:
        done = len(run.rows) // len(study.methods)
        print(f"interrupted: {done} of {study.trials} trials are done", file=sys.stderr)
        return 130
    return 0
