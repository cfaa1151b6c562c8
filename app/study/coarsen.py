"""A log without its time of day: every clock in it begins with the day of the trial."""

import os
from pathlib import Path

import msgspec

from app.recording.container import TrialEncoder, scan, to_ns
from app.recording.entry import index_of
from app.recording.errors import RecordingError
from app.recording.messages import decode, decode_header
from app.recording.schema import StepRecord, TrialEvent, TrialHeader, TrialSummary

_DAY_S = 86400


def copy_log(source: Path, target: Path) -> None:
    """Copy a finished log; differences of times stay as they are.

    The page's own clock (`client_time_ms`) is a time of day as well and is moved along.

    Raises:
        RecordingError: If the log cannot be read.
    """
    encoder, header, summary = TrialEncoder(), None, None
    shift_s = 0.0
    with source.open("rb") as file:
        try:
            for record, _, number, data in scan(file):
                message: msgspec.Struct
                if record == "trial":
                    header = decode_header(data)
                    shift_s = -(header.started_wall_s % _DAY_S)
                    start = header.started_wall_s + shift_s
                    message = header = msgspec.structs.replace(header, started_wall_s=start)
                    at_s = start
                elif record == "step":
                    step = decode(StepRecord, data)
                    at_s = step.wall_s + shift_s
                    ms = step.client_time_ms
                    message = msgspec.structs.replace(
                        step, wall_s=at_s, client_time_ms=ms + 1000 * shift_s if ms > 1e11 else ms
                    )
                elif record == "event":
                    event = decode(TrialEvent, data)
                    at_s = event.wall_s + shift_s
                    message = msgspec.structs.replace(event, wall_s=at_s)
                else:
                    summary = decode(TrialSummary, data)
                    at_s = summary.ended_wall_s + shift_s
                    message = summary = msgspec.structs.replace(summary, ended_wall_s=at_s)
                encoder.add(record, message, to_ns(at_s), number)
        except (RecordingError, OSError):
            raise
        except Exception as error:  # whatever mcap meets at damage
            raise RecordingError(f"{source} cannot be read: {error!r}") from None
    if header is None:
        raise RecordingError(f"{source} holds no trial")
    _write(encoder, header, summary, target)


def _write(
    encoder: TrialEncoder, header: TrialHeader, summary: TrialSummary | None, target: Path
) -> None:
    encoder.finish(index_of(header, summary) if summary is not None else {})
    with target.open("wb") as file:
        file.write(encoder.buffer.waiting)
        file.flush()
        os.fsync(file.fileno())
