"""Writes a trial's log while the trial runs, in a thread of its own.

The control loop only appends to a queue. The thread encodes what came, closes a compressed chunk
every 0.2 s, hands it to the file and forces it to the disk: a process that is killed loses at most
that much. A disk that is full, read-only or gone costs the loop nothing: the bytes wait in memory,
`error` says what is wrong, and the thread tries again.
"""

import logging
import threading
import time
from collections import deque
from pathlib import Path

import msgspec

from app.recording.cache import derive_cache
from app.recording.container import TrialEncoder, to_ns
from app.recording.entry import index_of
from app.recording.schema import StepRecord, TrialEvent, TrialHeader, TrialSummary
from app.recording.sink import FileSink
from app.recording.summarize import SummaryBuilder

ENCODE_PERIOD_S = 0.05
"""Encoding a few steps at a time keeps each grip on the interpreter's lock below a tenth of a
millisecond; all of a flush at once would delay the loop's tick by half of one."""

FLUSH_PERIOD_S = 0.2
RETRY_PERIOD_S = 0.5
GIVE_UP_S = 30.0
"""How long after `finish` a disk that refuses is still tried; then the `.part` stays behind."""

QUEUE_LIMIT = 60_000
"""[step] Ten minutes of a disk that hangs; beyond, steps are counted as lost."""

BUFFER_LIMIT = 256 * 2**20
"""[byte] More than an hour of a disk that is full; beyond, the queue fills."""

_log = logging.getLogger(__name__)


class TrialWriter:
    """The log of one running trial.

    No method but `close` waits for the disk, and none raises because of it.

    Args:
        folder: The session's folder; made where it is missing.
        header: Written first. Where its trial number is taken in the folder, the log gets the
            next free one: see `header`.
    """

    def __init__(self, folder: Path, header: TrialHeader) -> None:
        self.header = header
        """As written; its trial number is final once the file is open."""
        self.error: str | None = None
        """What is wrong with the log at the moment; None while all is well."""
        self.path: Path | None = None
        """The finished log; None until it is durable under its final name."""
        self.lost_steps = 0
        """Steps dropped because the disk has refused for many minutes."""
        self._sink = FileSink(Path(folder), header.trial)
        self._encoder: TrialEncoder  # made in the thread: a tick has no millisecond to spare
        self._queue: deque[StepRecord | TrialEvent] = deque()
        self._summaries = SummaryBuilder(header)
        self._summary: TrialSummary | None = None
        self._events = 0
        self._defect: str | None = None  # of the data, lasting; `error` adds the disk's
        self._deleted = False
        self._ended = False
        self._finish = threading.Event()
        self._settled = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"log-{header.trial}")
        self._thread.start()

    def write(self, step: StepRecord) -> None:
        """Record a step; takes about a microsecond. After `finish` it does nothing."""
        if self._finish.is_set():
            return
        if len(self._queue) >= QUEUE_LIMIT:
            self.lost_steps += 1
            return
        self._queue.append(step)

    def write_event(self, event: TrialEvent) -> None:
        """Record an event; never dropped before `finish`, nothing after it."""
        if not self._finish.is_set():
            self._queue.append(event)

    def finish(self, summary: TrialSummary | None = None) -> None:
        """End the log without waiting; `path` tells when it is durable. Only the first call counts.

        Args:
            summary: How the trial ended; without one it is made from the steps, "interrupted".
        """
        if not self._finish.is_set():
            self._summary = summary
            self._finish.set()

    def close(self, summary: TrialSummary | None = None, timeout_s: float = 10.0) -> Path | None:
        """End the log and wait until it is durable.

        Returns:
            The finished log; None where the disk still refuses after the time given (see `error`;
            the thread goes on trying).
        """
        self.finish(summary)
        self._settled.wait(timeout_s)
        return self.path

    def join(self, timeout_s: float | None = None) -> None:
        """Wait for the writer's thread, that is, also for the columnar cache."""
        self._thread.join(timeout_s)

    def _run(self) -> None:
        try:
            self._encoder = TrialEncoder()
            self._record()
        except Exception as error:  # a defect of ours; the loop must go on all the same
            self.error = f"the log of trial {self.header.trial} failed: {error!r}"
            _log.exception("writing the log of trial %s", self.header.trial)
        finally:
            self._sink.close()
            self._settled.set()
        if self.path is not None:
            try:
                derive_cache(self.path, pause=_breathe)
            except Exception:  # whatever it is, the cache can be derived again at any time
                _log.warning("no columnar cache of %s", self.path, exc_info=True)

    def _record(self) -> None:
        flush_at = time.monotonic()
        while True:
            self._encode()
            now = time.monotonic()
            if now >= flush_at:
                # From the plan, not from now, or every flush would add its own duration.
                wait = FLUSH_PERIOD_S if self._flush() else RETRY_PERIOD_S
                flush_at = max(flush_at + wait, now)
            if not threading.main_thread().is_alive():  # it died without closing the log
                self.finish()
            if self._finish.wait(min(ENCODE_PERIOD_S, max(0.0, flush_at - time.monotonic()))):
                break
        give_up_at = time.monotonic() + GIVE_UP_S
        while not self._complete():
            hopeless = self._deleted or not threading.main_thread().is_alive()
            if hopeless or time.monotonic() > give_up_at:
                return
            time.sleep(RETRY_PERIOD_S)

    def _encode(self) -> None:
        # The header comes first, and its trial number is known only once the file is open.
        if not self._sink.is_open:
            return
        while self._queue and len(self._encoder.buffer.waiting) < BUFFER_LIMIT:
            message = self._queue.popleft()
            try:
                self._add(message)
            except Exception as error:  # a message that cannot be encoded costs only itself
                self._defect = f"step {message.step} cannot be recorded: {error}"
        if self.lost_steps:
            self._defect = f"{self.lost_steps} steps are lost: the disk refused for too long"

    def _add(self, message: StepRecord | TrialEvent) -> None:
        time_ns = to_ns(message.wall_s)
        if isinstance(message, TrialEvent):
            self._encoder.add("event", message, time_ns, self._events)
            self._events += 1
            return
        bad = self._encoder.add("step", message, time_ns, self._summaries.steps)
        self._summaries.add(message)
        if bad and self._defect is None:
            self._defect = f"step {message.step} holds {bad} numbers that are not finite"

    def _flush(self) -> bool:
        """Bring everything so far to the disk; False (and `error`) where it refuses."""
        try:
            if not self._sink.is_open:
                self._open()
            if not self._ended:
                self._encoder.flush()
            self._sink.take(self._encoder.buffer)
            self._sink.sync()
        except OSError as error:
            self._refused(error)
            return False
        self.error = self._defect
        return True

    def _open(self) -> None:
        self._sink.open()
        if self._sink.number != self.header.trial:
            self.header = msgspec.structs.replace(self.header, trial=self._sink.number)
        self._encoder.add("trial", self.header, to_ns(self.header.started_wall_s), 0)
        self._encode()

    def _complete(self) -> bool:
        """Write what is left, the summary and the end, and publish; False to try again."""
        self._encode()
        if not self._flush() or self._queue:
            return False
        if not self._ended:
            summary = self._summary or self._summaries.interrupted()
            self._encoder.add("summary", summary, to_ns(summary.ended_wall_s), 0)
            self._encoder.finish(index_of(self.header, summary))
            self._ended = True
        if not self._flush():
            return False
        try:
            self.path = self._sink.publish()
        except OSError as error:
            self._refused(error)
            return False
        return True

    def _refused(self, error: OSError) -> None:
        self._deleted = isinstance(error, FileNotFoundError) and self._sink.is_open
        self.error = (
            f"the log of trial {self.header.trial} in {self._sink.folder}: {error.strerror}"
        )


def _breathe() -> None:
    """Let the control loop have the interpreter while the cache is derived beside it."""
    time.sleep(0.001)
