"""The MCAP container of a trial: how messages become its bytes, and its bytes messages.

Nothing here touches a disk: `TrialEncoder` fills a buffer, from which `sink.FileSink` takes what
it can write.
"""

import math
from collections.abc import Iterator
from typing import IO, Any

import msgspec
from mcap.records import Channel, Footer, Message, Statistics
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from app.recording.fields import RECORDS
from app.recording.messages import encode, json_schema

MAGIC = b"\x89MCAP0\r\n"
INDEX_RECORD = "hindsight.trial"
"""Name of the metadata record that holds what a list of trials shows of this one."""

_NULLS = (b":null", b"[null", b",null")

RECORD_SIZE_LIMIT = 256 * 2**20
"""[byte] Longer records are damage: a trial of an hour is smaller as a whole."""


class Buffer:
    """The stream mcap's Writer writes to: bytes in memory that wait for the disk.

    mcap's Writer loses its place when a write fails half-way; writing to memory never fails, and
    what waits here can be offered to the disk again and again.
    """

    def __init__(self) -> None:
        self.waiting = bytearray()
        self._taken = 0

    def write(self, data: bytes | bytearray | memoryview) -> int:
        """Append data."""
        self.waiting += data
        return len(data)

    def tell(self) -> int:
        """Bytes written so far, taken ones included."""
        return self._taken + len(self.waiting)

    def flush(self) -> None:
        """Nothing is held back."""

    def drop(self, count: int) -> None:
        """Forget the first bytes: they have reached the file."""
        del self.waiting[:count]
        self._taken += count


class TrialEncoder:
    """Turns the messages of one trial into the bytes of an MCAP file."""

    def __init__(self) -> None:
        self.buffer = Buffer()
        stream: Any = self.buffer
        self._writer = Writer(stream, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library="hindsight")
        self._channels: dict[str, int] = {}
        for record in RECORDS:
            schema_id = self._writer.register_schema(
                f"hindsight.{record}", "jsonschema", json_schema(record)
            )
            self._channels[record] = self._writer.register_channel(f"/{record}", "json", schema_id)

    def add(self, record: str, message: msgspec.Struct | bytes, time_ns: int, number: int) -> int:
        """Append one message.

        Args:
            record: "trial", "step", "event" or "summary".
            message: The struct, or its JSON.
            time_ns: Unix time, by which viewers place the message.
            number: Sequence number of the message within its topic.

        Returns:
            How many numbers in it were not finite: they have become null.
        """
        data = message if isinstance(message, bytes) else encode(message)
        self._writer.add_message(self._channels[record], time_ns, data, time_ns, number)
        return sum(data.count(mark) for mark in _NULLS) if record == "step" else 0

    def flush(self) -> None:
        """Close the compressed chunk in progress: all messages so far are in the buffer."""
        self._writer.flush()

    def finish(self, index: dict[str, str]) -> None:
        """End the file: the index record for lists of trials, then MCAP's own summary."""
        self._writer.add_metadata(INDEX_RECORD, index)
        self._writer.finish()


def to_ns(wall_s: float) -> int:
    """Unix time [s] as the container wants it: whole nanoseconds, unsigned 64 bits."""
    return min(max(0, round(wall_s * 1e9)), 2**63) if math.isfinite(wall_s) else 0


def scan(file: IO[bytes]) -> Iterator[tuple[str, int, int, bytes]]:
    """Messages of an MCAP file in the order written: record name, log time [ns], number, JSON.

    Checksums are verified chunk by chunk, and at the end the count: a hole of zeros reads like
    nothing at all. Reaching the end without an exception means the file is whole; a torn or damaged
    one raises whatever mcap meets at the damage, after all that precedes. Other programs' topics
    are passed over.
    """
    names: dict[int, str] = {}
    ended, count = False, 0
    reader = StreamReader(file, validate_crcs=True, record_size_limit=RECORD_SIZE_LIMIT)
    for entry in reader.records:
        if isinstance(entry, Message):
            count += 1
            record = names.get(entry.channel_id)
            if record is not None:
                yield record, entry.log_time, entry.sequence, entry.data
        elif isinstance(entry, Channel):
            topic = entry.topic.removeprefix("/")
            if topic in RECORDS and entry.message_encoding == "json":
                names[entry.id] = topic
        elif isinstance(entry, Statistics) and entry.message_count != count:
            raise EOFError(f"{entry.message_count - count} messages are missing")
        ended = isinstance(entry, Footer)
    if not ended:
        raise EOFError("the file has no end")
