"""Which messages of viser's client may reach a worker's viser server.

The list is one message long: the camera, which viser needs to create its handle of a client.
Everything else a client can send is interaction with viser's own panel, which the page hides,
or worse: `ShareUrlRequest` opens a public tunnel to the session, `FileTransferStartUpload` and
`GuiUpdateMessage` change the server's state. What is let through is decoded, checked and encoded
anew, so that no two parsers can disagree about it.
"""

import math
from typing import Annotated

import msgspec

from app.errors import AppError

MAX_FRAME_BYTES = 4096

_Triple = Annotated[list[float], msgspec.Meta(min_length=3, max_length=3)]
_Quadruple = Annotated[list[float], msgspec.Meta(min_length=4, max_length=4)]
_Pixels = Annotated[int, msgspec.Meta(ge=0, le=65536)]


class FrameError(AppError):
    """A frame of the viewer is not let through."""


class ViewerCamera(
    msgspec.Struct, tag_field="type", tag="ViewerCameraMessage", forbid_unknown_fields=True
):
    """viser's `ViewerCameraMessage`: pose T_world_camera, OpenCV convention; lengths in metres."""

    wxyz: _Quadruple
    position: _Triple
    fov: float
    near: float
    far: float
    image_height: _Pixels
    image_width: _Pixels
    look_at: _Triple
    up_direction: _Triple


class _Head(msgspec.Struct):
    type: str


_decoder = msgspec.msgpack.Decoder(ViewerCamera)
_head_decoder = msgspec.msgpack.Decoder(_Head)
_encoder = msgspec.msgpack.Encoder()


def filter_frame(frame: bytes) -> bytes:
    """The frame to pass on for one binary frame of viser's client.

    Raises:
        FrameError: If it is too large, malformed, not finite, or of another type.
    """
    if len(frame) > MAX_FRAME_BYTES:
        raise FrameError(f"frame of {len(frame)} bytes; valid: at most {MAX_FRAME_BYTES}")
    try:
        camera = _decoder.decode(frame)
    except (ValueError, RecursionError) as error:
        raise FrameError(f"{_type_of(frame)} is not let through: {error}") from None
    numbers = [*camera.wxyz, *camera.position, *camera.look_at, *camera.up_direction]
    if not all(map(math.isfinite, [*numbers, camera.fov, camera.near, camera.far])):
        raise FrameError("ViewerCameraMessage holds a number that is not finite")
    return _encoder.encode(camera)


def _type_of(frame: bytes) -> str:
    try:
        return repr(_head_decoder.decode(frame).type[:64])
    except (ValueError, RecursionError):
        return "a frame without a type"
