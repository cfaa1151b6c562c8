"""What the server does with the folder of sessions: complete torn logs, forget old demos."""

import logging
import shutil
import time
from pathlib import Path

from app.recording.recovery import Recovery, recover_folder, recover_trials
from app.recording.store import session_folder
from app.session.spec import WorkerSpec

logger = logging.getLogger("hindsight.web")


def complete_logs(sessions: Path) -> int:
    """Complete the logs that an earlier run left torn; returns how many."""
    return _report(recover_trials(sessions))


def complete_session(spec: WorkerSpec) -> int:
    """The same for one session whose worker is gone; returns how many."""
    participant = spec.participant or spec.id
    folder = session_folder(Path(spec.sessions), spec.study, participant, spec.session)
    return _report(recover_folder(folder))


def forget_old(sessions: Path, study: str, days: float) -> int:
    """Delete this study's participants whose newest file is older than `days`; returns how many.

    Meant for demonstrations: people were told how long their trials are kept.
    """
    limit_s = time.time() - days * 86400
    old = [
        folder
        for folder in sorted((sessions / study / "data" / "raw").glob("subject-*"))
        if folder.is_dir() and not folder.is_symlink() and _newest_s(folder) < limit_s
    ]
    for folder in old:
        shutil.rmtree(folder, onerror=lambda _, path, error: _not_deleted(path, error[1]))
    if old:
        logger.info("deleted %d demo sessions older than %g days", len(old), days)
    return len(old)


def _newest_s(folder: Path) -> float:
    return max(path.stat().st_mtime for path in (folder, *folder.rglob("*")))


def _not_deleted(path: str, error: BaseException) -> None:
    logger.warning("%s could not be deleted: %s", path, error)


def _report(recoveries: list[Recovery]) -> int:
    for recovery in recoveries:
        if recovery.problem:
            logger.warning("%s: not recovered: %s", recovery.path, recovery.problem)
    done = [r for r in recoveries if r.action in ("completed", "renamed")]
    if done:
        logger.info("completed %d torn logs", len(done))
    return len(done)
