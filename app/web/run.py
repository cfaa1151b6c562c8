"""`hindsight run`: take the port, tidy up, serve until told to stop."""

import errno
import logging
import os
import signal
import socket
import threading
import webbrowser

import uvicorn
from starlette.applications import Starlette

from app.errors import AppError
from app.web.config import ServerConfig
from app.web.housekeeping import complete_logs, forget_old
from app.web.server import create_app
from app.web.sessions import SessionRegistry
from app.web.workers import WorkerPool

MAX_FRAME_BYTES = 64 * 1024
"""Websocket frames beyond this close their socket unread (code 1009)."""
GRACEFUL_S = 3
"""How long open requests may take once the server stops [s]."""

logger = logging.getLogger("hindsight.web")


class ServeError(AppError):
    """The server cannot start with what it was given."""


def serve(config: ServerConfig) -> None:
    """Serve until SIGINT or SIGTERM; all workers have ended when it returns.

    Raises:
        ServeError: If the port or the sessions folder cannot be used.
    """
    logging.basicConfig(format="%(asctime)s %(name)s %(levelname)s: %(message)s")
    logger.setLevel(logging.INFO)
    _require_writable(config)
    with bind(config) as listener:
        complete_logs(config.sessions)
        if config.retention_days:
            forget_old(config.sessions, config.study, config.retention_days)
        url = address(config, listener)
        print(f"Hindsight is at {url}  (Ctrl+C ends it)", flush=True)
        if config.open_browser:
            threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
        serve_until_signal(HindsightServer(config), listener)


def bind(config: ServerConfig) -> socket.socket:
    """A listening socket: connections wait in it until the server is up.

    Raises:
        ServeError: Naming the address, and what to do.
    """
    where = f"{config.host} port {config.port}"
    try:
        found = socket.getaddrinfo(config.host, config.port, type=socket.SOCK_STREAM)
    except OSError as error:
        raise ServeError(f"host is {config.host!r}, which has no address: {error}") from None
    family, kind, protocol, _, target = found[0]
    listener = socket.socket(family, kind, protocol)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(target)
        listener.listen(128)
    except OSError as error:
        listener.close()
        raise ServeError(_bind_complaint(error, where)) from None
    return listener


def address(config: ServerConfig, listener: socket.socket) -> str:
    """Where the page is."""
    if config.public_origin:
        return config.public_origin
    host = f"[{config.host}]" if ":" in config.host else config.host
    return f"http://{host}:{listener.getsockname()[1]}"


class _Denials(logging.Filter):
    """Drops the complaint about a handshake that was answered by a refusal.

    uvicorn 0.54 writes it for every such answer, so that anyone could fill the log.
    """

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether the record is to be written."""
        return record.getMessage() != "ASGI callable returned without completing handshake."


_DENIALS = _Denials()


class HindsightServer(uvicorn.Server):
    """A uvicorn that says goodbye to the pages before it closes their sockets."""

    def __init__(self, config: ServerConfig, application: Starlette | None = None) -> None:
        """Prepare to serve.

        Args:
            config: Validated settings.
            application: What to serve, with its `SessionRegistry` in `state.registry`; None: the
                live page.
        """
        logging.getLogger("uvicorn.error").addFilter(_DENIALS)
        self.application = application or create_app(config, WorkerPool(config))
        super().__init__(
            uvicorn.Config(
                self.application,
                access_log=False,  # addresses of participants do not belong in logs
                log_level="warning",
                log_config=None,
                # uvloop, where there is one. asyncio's own loop reads every message into a block of
                # 256 KiB and shrinks it: that leaves holes, and the heap grows for hours.
                loop="auto",
                server_header=False,
                proxy_headers=config.behind_tls_proxy,
                ws="websockets-sansio",
                ws_max_size=MAX_FRAME_BYTES,
                ws_per_message_deflate=False,
                ws_ping_interval=5.0,
                ws_ping_timeout=10.0,
                lifespan="on",
                limit_concurrency=200 + 40 * config.max_workers,
                timeout_graceful_shutdown=GRACEFUL_S,
            )
        )

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the sessions in order, then the server."""
        registry: SessionRegistry = self.application.state.registry
        await registry.close()
        await super().shutdown(sockets)


def serve_until_signal(server: HindsightServer, listener: socket.socket) -> None:
    """Serve on a socket until SIGINT or SIGTERM.

    Raises:
        ServeError: If the server does not start.
    """
    # uvicorn raises the signals it caught once more after its shutdown: let them be.
    before = {s: signal.signal(s, lambda *_: None) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        server.run(sockets=[listener])
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if not server.started:
        raise ServeError("the server could not be started; the log above says why")


def _bind_complaint(error: OSError, where: str) -> str:
    if error.errno == errno.EADDRINUSE:
        return (
            f"{where} is in use by another program (another Hindsight?); end it, or choose "
            "another port: --port 8081, or --port 0 for any free one"
        )
    if error.errno == errno.EACCES:
        return f"{where} may not be used by this account; valid: ports from 1024 on"
    return f"cannot listen on {where}: {error.strerror}"


def _require_writable(config: ServerConfig) -> None:
    try:
        config.sessions.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ServeError(f"sessions folder {config.sessions}: {error.strerror}") from None
    if not os.access(config.sessions, os.W_OK | os.X_OK):
        raise ServeError(
            f"sessions folder {config.sessions} is not writable; choose another with --sessions"
        )
