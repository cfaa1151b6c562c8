"""What a browser may say, and that a refusal names the value and what is valid."""

import json
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.session.commands import COMMANDS, CommandError, parse_command
from app.web.messages import (
    MAX_MESSAGE_BYTES,
    ChangesCommand,
    InputMessage,
    MessageError,
    parse_message,
)

INPUT: dict[str, Any] = {
    "type": "input",
    "seq": 7,
    "t": 1.7e12,
    "left": [0, 1],
    "right": [-0.5, 0.25],
    "mode": "rotate",
    "device": "gamepad",
    "yaw": 0.5,
    "dead_zone": 0.1,
}


def test_an_input_is_read():
    """Whole numbers count as numbers, and what is missing has a default."""
    message = parse_message(json.dumps(INPUT))
    assert isinstance(message, InputMessage)
    assert (message.left, message.right) == ([0.0, 1.0], [-0.5, 0.25])
    bare = {k: INPUT[k] for k in ("type", "seq", "t", "left", "right")}
    message = parse_message(json.dumps(bare))
    assert isinstance(message, InputMessage)
    assert (message.mode, message.device, message.dead_zone) == ("translate", "none", 0.1)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"left": [3.5, 0]}, ["left.0 is 3.5", "less than or equal to 1"]),
        ({"right": [0]}, ["right is [0]", "at least 2"]),
        ({"left": "up"}, ["left is 'up'", "valid array"]),
        ({"seq": -1}, ["seq is -1", "greater than or equal to 0"]),
        ({"seq": 2**53}, ["seq is 9007199254740992"]),
        ({"seq": True}, ["seq is True"]),
        ({"mode": "dance"}, ["mode is 'dance'", "'translate' or 'rotate'"]),
        ({"device": "mouse"}, ["device is 'mouse'", "'gamepad'"]),
        ({"speed": 9}, ["speed is 9", "not permitted"]),
        ({"type": "push"}, ["'push'", "'input'", "'command'"]),
    ],
)
def test_a_bad_input_is_named(changes: dict[str, Any], words: list[str]):
    """The complaint holds the field, its value and what is valid."""
    with pytest.raises(MessageError) as caught:
        parse_message(json.dumps({**INPUT, **changes}))
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("text", ["NaN", "Infinity", "-Infinity", "1e999"])
@pytest.mark.parametrize("field", ["t", "yaw", "left"])
def test_numbers_that_are_not_finite_are_refused(field: str, text: str):
    """Neither the words some JSON writers use nor a number that overflows passes."""
    value = f"[{text}, 0]" if field == "left" else text
    message = json.dumps({**INPUT, field: "HERE"}).replace('"HERE"', value)
    with pytest.raises(MessageError):
        parse_message(message)


@pytest.mark.parametrize("text", ["", "{", "[]", "null", '"x"', "{}", "[" * 2000, '{"type":1}'])
def test_what_is_no_message_is_refused(text: str):
    """Broken JSON, other JSON, deep JSON."""
    with pytest.raises(MessageError):
        parse_message(text)


def test_an_oversized_message_is_refused_by_its_size():
    """Counted in bytes, not in characters."""
    with pytest.raises(MessageError, match=f"bytes; valid: at most {MAX_MESSAGE_BYTES}"):
        parse_message(json.dumps({**INPUT, "device": "é" * 2100}, ensure_ascii=False))


def test_a_refused_command_keeps_its_number():
    """So that the page learns which of its commands failed."""
    with pytest.raises(MessageError) as caught:
        parse_message('{"type":"command","id":12,"name":"method","method":7}')
    assert caught.value.command_id == 12
    assert "method is 7" in str(caught.value)


def test_a_missing_field_is_named():
    """What is missing is said, not the whole message repeated."""
    with pytest.raises(MessageError, match="^seq is missing$"):
        parse_message('{"type":"input","t":1,"left":[0,0],"right":[0,0]}')
    with pytest.raises(MessageError, match="^enabled is missing$"):
        parse_message('{"type":"command","id":1,"name":"assist"}')


def test_changes_hold_plain_values_only():
    """Numbers, flags, texts and null, 64 at most."""
    text = '{"type":"command","id":1,"name":"settings","changes":{"gain":0.5,"predictor":"paper"}}'
    message = parse_message(text)
    assert isinstance(message, ChangesCommand)
    assert message.changes == {"gain": 0.5, "predictor": "paper"}
    for bad in ({}, {"a": [1]}, {"a": {}}, {f"k{i}": 1 for i in range(65)}):
        with pytest.raises(MessageError):
            parse_message(
                json.dumps({"type": "command", "id": 1, "name": "layers", "changes": bad})
            )


KINDS = ("input", "event", "ping", "command", "none")
EXAMPLES: dict[str, dict[str, Any]] = {
    "new-trial": {"target": "glass", "seed": 3, "method": "policy", "scene": "default"},
    "method": {"method": "blend"},
    "assist": {"enabled": False},
    "settings": {"changes": {"gain": 0.5}},
    "layers": {"changes": {"slice": True}},
    "camera": {"preset": "top"},
    "theme": {"theme": "light"},
}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_of_the_worker_can_be_sent(name: str):
    """What the worker knows passes the edge, and comes out as something the worker takes."""
    text = json.dumps({"type": "command", "id": 1, "name": name, **EXAMPLES.get(name, {})})
    message = parse_message(text).model_dump(exclude_none=True)
    try:
        assert parse_command(message).name == name
    except CommandError as error:  # pragma: no cover
        raise AssertionError(f"the worker refuses what the edge lets through: {error}") from error


JSON = st.none() | st.booleans() | st.floats() | st.text(max_size=10) | st.lists(st.floats())


@given(st.dictionaries(st.sampled_from([*INPUT, "name", "id", "x"]), JSON), st.sampled_from(KINDS))
@settings(max_examples=200, deadline=None)
def test_any_object_is_read_or_refused(fields: dict[str, Any], kind: str):
    """No input ends in another exception."""
    try:
        parse_message(json.dumps({**INPUT, **fields, "type": kind}))
    except MessageError as error:
        assert str(error)
