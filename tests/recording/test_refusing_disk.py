"""A disk that is full, missing or taken away never raises into the loop and never harms a file."""

import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from app.recording.reader import read_steps
from app.recording.recovery import recover_folder
from app.recording.writer import TrialWriter
from tests.recording.samples import make_header, make_step, make_summary

# A process whose files may not grow beyond 100 kB: writes fail as on a full disk, in mid-chunk.
FULL_DISK = """
import resource, sys, time
from pathlib import Path
from app.recording.writer import TrialWriter
from tests.recording.samples import make_header, make_step, make_summary

hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
writer = TrialWriter(Path(sys.argv[1]), make_header())
number = 0
while writer.error is None:
    writer.write(make_step(number))
    number += 1
    time.sleep(0.01)
for number in range(number, number + 50):
    writer.write(make_step(number))
if sys.argv[2] == "space":
    resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
    path = writer.close(make_summary())
    print(path is not None, writer.error, number + 1)
else:
    print(writer.close(make_summary(), timeout_s=1.0), bool(writer.error), number + 1)
"""


def _run(folder: Path, then: str) -> list[str]:
    script = [sys.executable, "-c", FULL_DISK, str(folder), then]
    return subprocess.run(script, capture_output=True, text=True, check=True).stdout.split()


def _wait(condition: Callable[[], object]) -> None:
    while not condition():
        time.sleep(0.01)


def test_a_disk_with_space_again_gets_every_step(tmp_path: Path) -> None:
    """What the full disk refused waits in memory."""
    finished, error, written = _run(tmp_path, "space")
    assert (finished, error) == ("True", "None")
    steps = read_steps(tmp_path / "trial-001.mcap")
    assert steps == [make_step(number) for number in range(int(written))]


def test_a_disk_that_stays_full_keeps_a_true_prefix(tmp_path: Path) -> None:
    """The file ends in mid-chunk, and recovery finds all before it."""
    path, has_error, written = _run(tmp_path, "full")
    assert (path, has_error) == ("None", "True")
    assert (tmp_path / "trial-001.mcap.part").stat().st_size == 100_000
    (report,) = recover_folder(tmp_path)
    steps = read_steps(report.path)
    assert 0 < len(steps) < int(written)
    assert steps == [make_step(number) for number in range(len(steps))]


def test_a_folder_that_appears_late_gets_every_step(tmp_path: Path) -> None:
    """The writer says what is wrong, goes on trying, and says so when all is well again."""
    obstacle = tmp_path / "obstacle"
    obstacle.write_text("a file where the folder should be")
    writer = TrialWriter(obstacle / "session-1", make_header())
    writer.write(make_step(0))
    _wait(lambda: writer.error)
    assert "trial 1" in str(writer.error) and str(obstacle) in str(writer.error)
    obstacle.unlink()
    writer.write(make_step(1))
    _wait(lambda: writer.error is None)
    path = writer.close(make_summary())
    assert path is not None and read_steps(path) == [make_step(0), make_step(1)]


def test_a_folder_that_is_deleted_ends_the_log_not_the_loop(tmp_path: Path) -> None:
    """Someone who deletes a running session meant it: it is not brought back."""
    folder = tmp_path / "session-1"
    writer = TrialWriter(folder, make_header())
    _wait(lambda: list(folder.glob("*.part")) if folder.exists() else [])
    shutil.rmtree(folder)
    writer.write(make_step(0))
    _wait(lambda: writer.error)
    assert "deleted" in str(writer.error)
    assert writer.close(make_summary()) is None
    writer.join()
    assert not folder.exists()


def test_a_folder_that_is_renamed_keeps_its_trial(tmp_path: Path) -> None:
    """The log follows its folder."""
    folder, renamed = tmp_path / "session-1", tmp_path / "session-2"
    writer = TrialWriter(folder, make_header())
    _wait(lambda: list(folder.glob("*.part")) if folder.exists() else [])
    folder.rename(renamed)
    writer.write(make_step(0))
    assert writer.close(make_summary()) == renamed / "trial-001.mcap"
    assert read_steps(renamed / "trial-001.mcap") == [make_step(0)]


def test_closing_twice_is_fine(tmp_path: Path) -> None:
    """The first summary counts, and steps after the end are not recorded."""
    writer = TrialWriter(tmp_path, make_header())
    writer.write(make_step(0))
    first = writer.close(make_summary(outcome="timeout"))
    writer.write(make_step(1))
    assert writer.close(make_summary(outcome="grasped")) == first
    assert first is not None and read_steps(first) == [make_step(0)]


def test_a_program_that_forgets_to_close_still_ends_its_log(tmp_path: Path) -> None:
    """When the main thread is gone the log is finished, and the process can end."""
    script = (
        "import sys; from pathlib import Path\n"
        "from app.recording.writer import TrialWriter\n"
        "from tests.recording.samples import make_header, make_step\n"
        "TrialWriter(Path(sys.argv[1]), make_header()).write(make_step(0))\n"
        "sys.exit(3)"
    )
    assert subprocess.run([sys.executable, "-c", script, str(tmp_path)]).returncode == 3
    assert read_steps(tmp_path / "trial-001.mcap") == [make_step(0)]
    assert (tmp_path / "trial-001.parquet").exists()
