"""The filter on what a viewer may send: one message, checked and encoded anew."""

import math
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from viser import _messages

from app.web.view_messages import MAX_FRAME_BYTES, FrameError, ViewerCamera, filter_frame

CAMERA: dict[str, Any] = {
    "type": "ViewerCameraMessage",
    "wxyz": [1, 0, 0, 0],
    "position": [0.5, -1.25, 1],
    "fov": 0.66,
    "near": 0.01,
    "far": 1000,
    "image_height": 600,
    "image_width": 800,
    "look_at": [0, 0, 0],
    "up_direction": [0, 0, 1],
}
CLIENT_MESSAGES = sorted(
    name
    for name, value in vars(_messages).items()
    if isinstance(value, type)
    and issubclass(value, _messages.Message)
    and not name.startswith("_")
    and name not in ("Message", "ViewerCameraMessage")
)


def pack(**changes: Any) -> bytes:
    """A camera frame with changes."""
    return msgspec.msgpack.encode({**CAMERA, **changes})


def test_a_camera_passes():
    """The client's camera comes out with the same numbers."""
    passed = msgspec.msgpack.decode(filter_frame(pack()))
    assert passed == CAMERA


@pytest.mark.parametrize("name", CLIENT_MESSAGES)
def test_no_other_message_passes(name: str):
    """Whatever else viser knows is refused by name, even dressed as a camera."""
    for frame in (msgspec.msgpack.encode({"type": name}), pack(type=name)):
        with pytest.raises(FrameError, match=name):
            filter_frame(frame)


@pytest.mark.parametrize(
    "changes",
    [
        {"position": [0, 0]},
        {"position": [0, 0, math.nan]},
        {"fov": math.inf},
        {"wxyz": "1000"},
        {"image_width": -1},
        {"look_at": None},
        {"extra": 1},
    ],
)
def test_a_bad_camera_is_refused(changes: dict[str, Any]):
    """Wrong shapes, numbers that are not finite, and fields viser does not know."""
    with pytest.raises(FrameError):
        filter_frame(pack(**changes))


def test_a_frame_that_is_not_utf8_is_refused():
    """Torn text is no camera."""
    with pytest.raises(FrameError, match="ViewerCameraMessage"):
        filter_frame(pack().replace(b"image_width", b"image_widt\xcd"))


def test_an_oversized_frame_is_refused_by_its_size():
    """The message names the size and the limit."""
    with pytest.raises(FrameError, match=f"{MAX_FRAME_BYTES + 1} bytes.*{MAX_FRAME_BYTES}"):
        filter_frame(b"\x00" * (MAX_FRAME_BYTES + 1))


def test_a_doubled_type_cannot_smuggle_another_message():
    """Two parsers may disagree on a key given twice; what leaves the filter has it once."""
    body = msgspec.msgpack.encode(CAMERA)[1:]
    extra = msgspec.msgpack.encode("type") + msgspec.msgpack.encode("ShareUrlRequest")
    size = len(CAMERA) + 1
    for frame in (bytes([0x80 | size]) + body + extra, bytes([0x80 | size]) + extra + body):
        try:
            passed = filter_frame(frame)
        except FrameError:
            continue
        assert b"ShareUrlRequest" not in passed
        assert msgspec.msgpack.decode(passed)["type"] == "ViewerCameraMessage"


@given(st.binary(max_size=200))
@settings(max_examples=300, deadline=None)
def test_any_bytes_either_pass_as_a_camera_or_are_refused(frame: bytes):
    """No input ends in another exception."""
    try:
        passed = filter_frame(frame)
    except FrameError:
        return
    assert msgspec.msgpack.decode(passed, type=ViewerCamera)
