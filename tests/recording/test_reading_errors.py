"""A file that is no finished trial is refused with its name and the reason."""

from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import pytest
from mcap.writer import Writer

from app.errors import AppError
from app.recording.container import TrialEncoder
from app.recording.errors import RecordingError
from app.recording.listing import entry_of
from app.recording.reader import load_columns, read_steps, read_trial
from tests.recording.samples import make_header, make_step


def _foreign_mcap() -> bytes:
    stream = BytesIO()
    writer = Writer(stream)
    writer.start()
    schema = writer.register_schema("chatter", "jsonschema", b"{}")
    channel = writer.register_channel("/chatter", "json", schema)
    writer.add_message(channel, 0, b"{}", 0)
    writer.finish()
    return stream.getvalue()


def _log(**header: object) -> bytes:
    encoder = TrialEncoder()
    encoder.add("trial", make_header(**header), 0, 0)
    encoder.add("step", make_step(0), 0, 0)
    encoder.finish({})
    return bytes(encoder.buffer.waiting)


def _without_a_field() -> bytes:
    encoder = TrialEncoder()
    encoder.add("trial", make_header(), 0, 0)
    encoder.add("step", b'{"step":1}', 0, 0)
    encoder.finish({})
    return bytes(encoder.buffer.waiting)


CASES: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "is empty"),
    "text": (b"time,x,y\n0,1,2\n", "is not an MCAP file"),
    "torn": (_log()[:-200], "is torn"),
    "foreign": (_foreign_mcap(), "without a Hindsight trial"),
    "newer": (_log(schema_version=2), "record format 2"),
    "incomplete": (_without_a_field(), "missing required field"),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("read", [read_trial, read_steps, load_columns])
def test_the_error_names_file_and_problem(
    tmp_path: Path, case: str, read: Callable[[Path], object]
) -> None:
    """The same for every way to read."""
    content, problem = CASES[case]
    path = tmp_path / "trial-001.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=problem) as caught:
        read(path)
    assert str(path) in str(caught.value)
    assert isinstance(caught.value, AppError)
    assert not path.with_suffix(".parquet").exists()


@pytest.mark.parametrize("case", ["empty", "text", "torn", "foreign", "newer"])
def test_an_entry_has_the_same_problems(tmp_path: Path, case: str) -> None:
    """A list of trials says what reading would say."""
    content, problem = CASES[case]
    path = tmp_path / "trial-001.mcap"
    path.write_bytes(content)
    assert problem in (said := entry_of(path).problem) and str(path) in said


def test_a_missing_file_or_a_folder_is_named(tmp_path: Path) -> None:
    """What the operating system says, with the path."""
    with pytest.raises(RecordingError, match="does not exist"):
        read_trial(tmp_path / "trial-009.mcap")
    with pytest.raises(RecordingError, match="cannot read"):
        read_trial(tmp_path)


def test_an_unknown_column_names_the_valid_ones(record: Callable[..., Path]) -> None:
    """A typing error in an analysis is found at once."""
    with pytest.raises(RecordingError, match="no column beleif .*belief"):
        load_columns(record(), columns=["beleif"])


def test_every_flipped_bit_is_noticed(record: Callable[..., Path], tmp_path: Path) -> None:
    """Damage to a chunk of a finished file is an error, never a wrong number."""
    content = bytearray(record(tmp_path).read_bytes())
    original = read_steps(tmp_path / "trial-001.mcap")
    damaged = tmp_path / "trial-002.mcap"
    for offset in range(600, len(content), len(content) // 40):
        content[offset] ^= 0x10
        damaged.write_bytes(content)
        try:
            assert read_steps(damaged) == original  # it hit an index, which reading does not use
        except RecordingError as error:
            assert str(damaged) in str(error)
        content[offset] ^= 0x10
