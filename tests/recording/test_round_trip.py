"""What is written is what is read, bit for bit."""

import json
import math
import struct
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from app.recording.columns import same_columns, to_columns
from app.recording.fields import RECORDS, fields
from app.recording.messages import decode, encode, json_schema
from app.recording.reader import load_columns, read_steps, read_trial
from app.recording.schema import StepRecord
from app.recording.writer import TrialWriter
from tests.recording.samples import make_event, make_header, make_step, make_summary


def test_reading_a_trial_gives_what_was_written(
    record: Callable[..., Path], steps: list[StepRecord]
) -> None:
    """Header, steps, events and summary come back equal."""
    path = record(attempt=2)
    log = read_trial(path)
    assert path.name == "trial-001.mcap"
    assert log.header == make_header(attempt=2)
    assert log.events == (make_event(3),)
    assert log.summary == make_summary(steps=len(steps))
    assert read_steps(path) == steps
    assert same_columns(log.steps, to_columns(steps))


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_float64_keeps_every_bit(number: float) -> None:
    """−0, subnormals and all 53 bits survive the JSON."""
    step = make_step(0, time_s=number, ctrl=[number, -number])
    back = decode(StepRecord, encode(step))
    assert struct.pack("<3d", back.time_s, *back.ctrl) == struct.pack("<3d", number, *step.ctrl)


def test_a_number_that_is_not_finite_is_evidence_not_an_error(tmp_path: Path) -> None:
    """The log stays readable, says NaN, and the writer says which step broke the promise."""
    writer = TrialWriter(tmp_path, make_header())
    writer.write(make_step(0))
    writer.write(make_step(1, ctrl=[math.inf, 1.0]))
    path = writer.close(make_summary())
    assert path is not None
    assert writer.error == "step 1 holds 1 numbers that are not finite"
    assert math.isnan(read_steps(path)[1].ctrl[0])
    assert math.isnan(load_columns(path)["ctrl"][1, 0])


def test_numpy_values_are_recorded_as_numbers(tmp_path: Path) -> None:
    """A forgotten float() or tolist() costs nobody a log."""
    writer = TrialWriter(tmp_path, make_header())
    writer.write(make_step(0, time_s=np.float64(0.1), ctrl=np.array([0.1, 0.2])))
    path = writer.close(make_summary())
    assert path is not None, writer.error
    assert read_steps(path)[0].ctrl == [0.1, 0.2]
    assert read_steps(path)[0].time_s == 0.1


def test_a_step_that_cannot_be_recorded_costs_only_itself(tmp_path: Path) -> None:
    """The writer names it and goes on."""
    writer = TrialWriter(tmp_path, make_header())
    for step in (make_step(0), make_step(1, ctrl=[object()]), make_step(2)):
        writer.write(step)
    path = writer.close(make_summary())
    assert path is not None
    assert writer.error is not None and "step 1" in writer.error
    assert [step.step for step in read_steps(path)] == [0, 2]


def test_the_mcap_library_reads_a_finished_file(
    record: Callable[..., Path], steps: list[StepRecord]
) -> None:
    """An independent reader finds topics, counts, times, and JSON that its schema describes."""
    with open(record(), "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        topics = {channel.topic: n for n, channel in summary.channels.items()}
        counts = summary.statistics.channel_message_counts
        assert {topic: counts[n] for topic, n in topics.items()} == {
            "/trial": 1,
            "/step": len(steps),
            "/event": 1,
            "/summary": 1,
        }
        for schema, channel, message in reader.iter_messages():
            assert schema is not None and schema.encoding == "jsonschema"
            assert channel.message_encoding == "json"
            described = json.loads(schema.data)["properties"]
            assert set(json.loads(message.data)) == set(described)
            if channel.topic == "/step":
                assert message.log_time == round(steps[message.sequence].wall_s * 1e9)


@pytest.mark.parametrize("name", RECORDS)
def test_schemas_are_flat_and_described(name: str) -> None:
    """Single values, or lists of single values, each with a description."""
    text = json_schema(name).decode()
    assert not any(word in text for word in ("$ref", "anyOf", "prefixItems", "oneOf", "allOf"))
    schema = json.loads(text)
    assert schema["type"] == "object"
    for described in schema["properties"].values():
        kind = described["items"] if described["type"] == "array" else described
        assert kind["type"] in ("string", "integer", "number", "boolean")
        assert described["description"]


def test_every_field_is_in_the_data_dictionary() -> None:
    """In the schema's order, with a description, and the unit that its name ends in."""
    known = [(line.record, line.name) for line in fields()]
    assert known == [
        (name, info.name) for name, kind in RECORDS.items() for info in msgspec.structs.fields(kind)
    ]
    units = {"_s": "s", "_m": "m", "_ms": "ms", "_rad": "rad", "_rad_s": "rad/s"}
    for line in fields():
        assert line.description and line.description != line.name, line.name
        assert bool(line.shape) == line.type.startswith("list"), line.name
        endings = [ending for ending in units if line.name.endswith(ending)]
        if endings:
            assert line.unit == units[max(endings, key=len)], line.name
