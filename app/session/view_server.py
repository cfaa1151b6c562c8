"""The viser server for one session: on loopback, on a free port, and quiet."""

import contextlib
import io
from collections.abc import Iterator

import viser


@contextlib.contextmanager
def view_server() -> Iterator[viser.ViserServer]:
    """A server that stops at the end; it prints banners whatever `verbose` says, caught here."""
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        yield server
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()
