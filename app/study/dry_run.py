"""`hindsight study … --dry-run`: simulated participants through the real server, end to end."""

import csv
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from app.errors import AppError
from app.study.check import check
from app.study.errors import StudyError
from app.study.load import load_study
from app.study.plan import cells
from app.study.visitor import Visitor

START_S = 120.0


def dry_run(target: str, participants: int = 0, out: Path | None = None) -> int:
    """Send participants through a test run in a folder of its own, and say what came out.

    Args:
        target: A study's name or file.
        participants: How many; 0: two for every cell. More than there are places wait.
        out: Folder of sessions to leave the study in, to try an analysis on; None: it is deleted.

    Returns:
        The exit code: 0 where everybody got a code and the tables are right to the row.

    Raises:
        StudyError: If the server does not start, or there is such a study in `out`.
    """
    study = load_study(target)
    if out is not None and (out / study.name).exists():
        raise StudyError(f"{out / study.name} exists already; name another folder with --out")
    print(check(study) + "\n")
    n = participants or 2 * len(cells(study))
    with tempfile.TemporaryDirectory(prefix="hindsight-dry-run-") as folder:
        sessions = out or Path(folder) / "sessions"
        process, url = _serve(target, sessions, Path(folder) / "server.log")
        began = time.monotonic()
        try:
            problems, waited = _send(url, n)
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(60)
        problems += _check_tables(sessions / study.name, study.name, n, len(cells(study)))
    took = time.monotonic() - began
    print(f"{n} simulated participants in {took:.0f} s; {waited} times no place was free")
    if out is not None:
        print(f"The study is in {out / study.name}")
    for problem in problems:
        print(f"problem: {problem}", file=sys.stderr)
    print("The dry run found no problem." if not problems else f"{len(problems)} problems.")
    return 1 if problems else 0


def _serve(target: str, sessions: Path, log: Path) -> tuple[subprocess.Popen[bytes], str]:
    command = [sys.executable, "-u", "-m", "app", "study", target, "--port", "0", "--test-run"]
    with log.open("wb") as output:
        process = subprocess.Popen(
            [*command, "--sessions", str(sessions)], stdout=output, stderr=subprocess.STDOUT
        )
    deadline = time.monotonic() + START_S
    while time.monotonic() < deadline and process.poll() is None:
        found = re.search(r"is at (http://\S+)", log.read_text(encoding="utf-8"))
        if found:
            return process, found[1]
        time.sleep(0.1)
    process.kill()
    raise StudyError(f"the server did not start:\n{log.read_text(encoding='utf-8')}")


def _send(url: str, n: int) -> tuple[list[str], int]:
    """Everybody at once; returns what went wrong, and how often somebody had to wait."""
    stop = threading.Event()
    visitors = [Visitor(url, f"dry-run-participant-{i:06d}", stop=stop) for i in range(n)]

    def one(visitor: Visitor) -> str:
        visitor.arrive("?fast=1")
        state = visitor.take_part()
        return "" if state.get("completion") else "the last page shows no completion code"

    problems: list[str] = []
    with ThreadPoolExecutor(n) as pool:
        jobs = {pool.submit(one, visitor): i for i, visitor in enumerate(visitors)}
        for done, job in enumerate(as_completed(jobs), start=1):
            try:
                text = job.result()
            except (AppError, OSError) as error:
                text = str(error)
            if text:
                problems.append(f"participant {jobs[job] + 1}: {text}")
            print(f"{done} of {n} participants are through", file=sys.stderr)
    return problems, sum(visitor.waited for visitor in visitors)


def _check_tables(root: Path, name: str, n: int, n_cells: int) -> list[str]:
    """Compare the tables with what the design says."""
    people, trials, answers = (
        _rows(root / "data" / f"study-{name}_description-{what}_data.csv")
        for what in ("participants", "trials", "survey")
    )
    problems = []
    done = [row for row in people if row["status"] == "completed"]
    if len(done) != n:
        problems.append(f"{len(done)} of {n} participants are completed")
    fill = Counter(row["cell"] for row in done)
    if fill and max(fill.values()) - min(fill.get(str(c + 1), 0) for c in range(n_cells)) > 1:
        problems.append(f"cells are filled unevenly: {dict(fill)}")
    print("Completed per cell: " + ", ".join(f"{c}: {k}" for c, k in sorted(fill.items())))
    counted = Counter((r["participant_id"], r["method"]) for r in trials if r["counted"] == "true")
    recorded = {(r["participant_id"], r["method"]) for r in trials if r["part"] == "recorded"}
    outcomes = Counter(row["outcome"] for row in trials)
    print("Outcomes: " + ", ".join(f"{k} {v}" for k, v in outcomes.most_common()))
    if len({counted[key] for key in recorded}) > 1:
        print("Some trials have no counted attempt: they failed as often as is allowed.")
    missing = {row["participant_id"] for row in done} - {row["participant_id"] for row in answers}
    if missing:
        problems.append(f"no answers of {', '.join(sorted(missing))}")
    late = [float(row["late_share"]) for row in trials if row["late_share"]]
    if late:
        print(f"Late ticks: {100 * sum(late) / len(late):.1f} % on average, recorded per trial")
    return problems


def _rows(path: Path) -> list[dict[str, str]]:
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))
    except FileNotFoundError:
        return []
