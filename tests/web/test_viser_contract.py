"""What we rely on inside viser, so that an upgrade which changes it fails here and not on stage."""

import msgspec
import numpy as np
import viser
from viser import _messages

from app.web.view_messages import ViewerCamera, filter_frame
from app.web.viewer_page import client_folder, subprotocol, viewer_page


def test_the_client_is_one_page_with_one_head():
    """Our style and script go in before the only </head>, and everything else stays as it was."""
    original = (client_folder() / "index.html").read_bytes()
    page, tag = viewer_page()
    before, after = original.split(b"</head>")
    assert page.startswith(before)
    assert page.endswith(b"</head>" + after)
    assert b"document.hasFocus = () => true" in page[len(before) :]
    assert tag.strip('"').isalnum()


def test_the_subprotocol_is_the_one_that_viser_accepts():
    """The client's source and the server agree on the name; the server compares the version."""
    source = client_folder().parent / "src" / "WebsocketClientWorker.ts"
    assert "`viser-v${VISER_VERSION}`" in source.read_text()
    assert subprotocol() == f"viser-v{viser.__version__}"


def test_the_client_reads_its_socket_from_its_path_and_retries_by_focus():
    """The id goes into the path because the query is dropped; a retry asks document.hasFocus."""
    sources = client_folder().parent / "src"
    assert 'server.split("?")[0]' in (sources / "App.tsx").read_text()
    assert "document.hasFocus()" in (sources / "WebsocketInterface.tsx").read_text()
    assert "w.__viserMutable = mutable.current" in (sources / "App.tsx").read_text()


def test_the_camera_message_has_exactly_the_fields_we_pass_on():
    """Our copy of ViewerCameraMessage matches viser's, field by field."""
    theirs = {f for f in _messages.ViewerCameraMessage.__dataclass_fields__ if f[0] != "_"}
    assert set(ViewerCamera.__struct_fields__) == theirs - {"excluded_self_client"}
    assert ViewerCamera.__struct_config__.tag == _messages.ViewerCameraMessage.__name__


def test_viser_reads_what_the_filter_writes():
    """A filtered frame deserializes to the message that went in."""
    sent = _messages.ViewerCameraMessage(
        wxyz=(1.0, 0.0, 0.0, 0.0),
        position=(1.5, -2.0, 0.25),
        fov=0.7,
        near=0.01,
        far=1000.0,
        image_height=400,
        image_width=300,
        look_at=(0.0, 0.0, 0.0),
        up_direction=(0.0, 0.0, 1.0),
    )
    frame = msgspec.msgpack.encode(sent.as_serializable_dict())
    received = _messages.Message.deserialize(filter_frame(frame))
    assert isinstance(received, _messages.ViewerCameraMessage)
    assert received == sent
    assert np.isfinite(received.position).all()


def test_the_dangerous_messages_still_have_the_names_we_know():
    """The tunnel and the file transfer exist under these names, and none of them is let through."""
    for name in ("ShareUrlRequest", "ShareUrlDisconnect", "FileTransferStartUpload"):
        assert hasattr(_messages, name)
        assert name != ViewerCamera.__struct_config__.tag
