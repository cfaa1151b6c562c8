"""The logs of a session's trials: one after another, or none."""

from pathlib import Path

from app.recording.numbering import reserve_trial
from app.recording.schema import StepRecord, TrialEvent, TrialHeader, TrialSummary
from app.recording.writer import TrialWriter


class Recorder:
    """Hands records to the running trial's log; nothing of it waits for the disk."""

    def __init__(self, folder: Path | None) -> None:
        """Prepare.

        Args:
            folder: The session's open folder; None: nothing is recorded.

        Raises:
            RecordingError: If the folder cannot be written.
        """
        self._folder = folder
        self._next = 1
        self._writer: TrialWriter | None = None
        self._finishing: list[TrialWriter] = []
        if folder is not None:
            self._next = reserve_trial(folder)

    @property
    def is_on(self) -> bool:
        """Whether trials are recorded."""
        return self._folder is not None

    @property
    def is_open(self) -> bool:
        """Whether a trial's log is open."""
        return self._writer is not None

    def next_number(self) -> int:
        """Number of the next trial's log."""
        number, self._next = self._next, self._next + 1
        return number

    def begin(self, header: TrialHeader) -> None:
        """Open the log of a trial; one that is still open ends as interrupted."""
        self.finish(None)
        if self._folder is not None:
            self._writer = TrialWriter(self._folder, header)

    def write(self, record: StepRecord, events: list[TrialEvent]) -> None:
        """Record a tick and what happened in it."""
        if self._writer is not None:
            for event in events:
                self._writer.write_event(event)
            self._writer.write(record)

    def write_event(self, event: TrialEvent) -> None:
        """Record an event between ticks."""
        if self._writer is not None:
            self._writer.write_event(event)

    def finish(self, summary: TrialSummary | None) -> None:
        """End the trial's log without waiting."""
        if self._writer is not None:
            self._writer.finish(summary)
            self._finishing = [w for w in self._finishing if w.path is None] + [self._writer]
            self._writer = None

    @property
    def problem(self) -> str | None:
        """What is wrong with the logs now, in words; None while all is well."""
        writers = self._finishing if self._writer is None else [*self._finishing, self._writer]
        return next((w.error for w in writers if w.error), None)

    def close(self, timeout_s: float = 5.0) -> None:
        """Wait until the logs that were finished are durable."""
        self.finish(None)
        for writer in self._finishing:
            writer.close(timeout_s=timeout_s)
