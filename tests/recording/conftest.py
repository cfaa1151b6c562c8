"""What several laws of recording need."""

from collections.abc import Callable
from pathlib import Path

import pytest

from app.recording.schema import StepRecord
from app.recording.writer import TrialWriter
from tests.recording.samples import make_event, make_header, make_step, make_summary


@pytest.fixture
def steps() -> list[StepRecord]:
    """Half a second of a trial."""
    return [make_step(number) for number in range(50)]


@pytest.fixture
def record(tmp_path: Path, steps: list[StepRecord]) -> Callable[..., Path]:
    """Record a finished trial of `steps`, with an event, into a folder."""

    def write(folder: Path = tmp_path, **header: object) -> Path:
        writer = TrialWriter(folder, make_header(**header))
        for step in steps:
            writer.write(step)
        writer.write_event(make_event(3))
        path = writer.close(make_summary(steps=len(steps)))
        writer.join()
        assert path is not None, writer.error
        return path

    return write
