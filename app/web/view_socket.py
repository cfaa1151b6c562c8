"""`WS /view/{id}`: a byte proxy between viser's client and the viser server of the worker."""

import asyncio
import logging

from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.typing import Subprotocol

from app.web.access import check_socket, deny
from app.web.config import ServerConfig
from app.web.limits import KeyedBuckets, QuietLog, TokenBucket
from app.web.session import Session
from app.web.sessions import SessionRegistry
from app.web.view_messages import FrameError, filter_frame
from app.web.viewer_page import subprotocol
from app.web.worker import Worker

READY_WAIT_S = 4.0
"""viser's client gives a handshake up after 5 s and tries again."""
FRAMES_PER_S = 120.0
"""viser's client sends its camera at most 50 times a second."""
MAX_REFUSED = 50
"""Refused frames beyond which a socket is closed; they wear off at 1 a second."""
MAX_SOCKETS = 16
"""Open viewers of one session."""
CONNECTS_PER_S = 5.0
CONNECT_BURST = 60
VIEWER_GONE = 1011
"""Websocket close code where viser does not answer, or no longer."""
SURE_S = 1.0
"""A worker that has died is known to be dead by then [s]."""
NOTICES_PER_S = 0.05
"""viser's client tries again every second; its page is told three times a minute."""

logger = logging.getLogger("hindsight.web")
_refused_log = QuietLog(logger)


class ViewSockets:
    """The endpoint, with the registry it serves."""

    def __init__(self, registry: SessionRegistry, config: ServerConfig) -> None:
        self._registry = registry
        self._config = config
        self._connects = KeyedBuckets(CONNECTS_PER_S, CONNECT_BURST)
        self._notices = KeyedBuckets(NOTICES_PER_S, 1)

    async def endpoint(self, socket: WebSocket) -> None:
        """One connection, from its handshake to its end."""
        access = check_socket(socket, self._registry, self._config)
        if isinstance(access, str):
            _refused_log.warning(f"refused a view socket: {access}")
            await deny(socket, 403, access)
            return
        session = access.session
        asked = socket.scope.get("subprotocols") or []
        if subprotocol() not in asked:
            await deny(socket, 400, f"subprotocols are {asked}; valid: {subprotocol()}")
        elif session.sockets >= MAX_SOCKETS or not self._connects.take(session.id):
            await deny(socket, 429, f"more than {MAX_SOCKETS} viewers, or too many in a short time")
        elif not await _worker_ready(session):
            await deny(socket, 503, "the simulation is not running")
        else:
            session.sockets += 1
            worker = session.worker
            assert worker is not None
            try:
                code = await proxy_view(socket, worker.viewer_port, session.id)
            finally:
                session.sockets -= 1
            if code == VIEWER_GONE:
                await self._tell(session, worker)

    async def _tell(self, session: Session, worker: Worker) -> None:
        """Say that the picture is gone, unless the whole worker is, which is said otherwise."""
        await asyncio.sleep(SURE_S)
        if session.worker is worker and worker.alive and self._notices.take(session.id):
            session.say("error", "The picture is gone; the robot still obeys. Reload the page.")


async def _worker_ready(session: Session) -> bool:
    worker = session.worker
    if worker is None:
        return False
    try:
        await asyncio.wait_for(worker.ready.wait(), READY_WAIT_S)
    except TimeoutError:
        return False
    return worker.alive and worker.viewer_port > 0


async def proxy_view(socket: WebSocket, port: int, session_id: str) -> int:
    """Carry frames between a browser that may see a view and the viser server on a local port.

    Returns:
        The close code; `VIEWER_GONE` also where there was no connection.
    """
    try:
        upstream = await connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[Subprotocol(subprotocol())],
            compression=None,
            max_size=None,  # ours, and scenes hold megabytes of meshes
            ping_interval=None,  # loopback: a dead worker's socket closes
            open_timeout=READY_WAIT_S,
            proxy=None,  # never through the environment's http_proxy
        )
    except (OSError, TimeoutError, WebSocketException) as error:
        _refused_log.warning(f"session {session_id}: the viewer does not answer: {error}")
        await deny(socket, 502, "the viewer does not answer")
        return VIEWER_GONE
    code, reason = VIEWER_GONE, "the viewer is gone"
    try:
        await socket.accept(subprotocol=upstream.subprotocol)
        down = asyncio.create_task(_pump_down(upstream, socket))
        up = asyncio.create_task(_pump_up(socket, upstream, session_id))
        try:
            done, _ = await asyncio.wait((down, up), return_when=asyncio.FIRST_COMPLETED)
            code, reason = next(iter(done)).result()
        finally:
            down.cancel()
            up.cancel()
            await asyncio.gather(down, up, return_exceptions=True)
    finally:
        await upstream.close()
        try:
            await socket.close(code, reason)
        except (RuntimeError, WebSocketDisconnect):
            pass  # the browser was first
    return code


async def _pump_down(upstream: ClientConnection, socket: WebSocket) -> tuple[int, str]:
    """Worker to browser; the worker is ours, so its bytes pass as they are."""
    try:
        async for frame in upstream:
            if isinstance(frame, bytes):
                await socket.send_bytes(frame)
    except (ConnectionClosed, WebSocketDisconnect, OSError):
        pass
    code, reason = upstream.close_code, upstream.close_reason
    # 1002 is viser's "version mismatch", which its client shows
    return (1002, reason or "") if code == 1002 else (VIEWER_GONE, "the viewer is gone")


async def _pump_up(
    socket: WebSocket, upstream: ClientConnection, session_id: str
) -> tuple[int, str]:
    """Browser to worker; only what `filter_frame` lets through."""
    rate = TokenBucket(FRAMES_PER_S, FRAMES_PER_S)
    tolerance = TokenBucket(1.0, MAX_REFUSED)
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            return 1000, ""
        frame = message.get("bytes")
        if frame is None:
            _refused_log.warning(f"session {session_id}: a text frame on a view socket")
            return 1003, "text frame; valid: binary frames"
        try:
            if not rate.take():
                raise FrameError(f"more than {FRAMES_PER_S:.0f} frames a second")
            passed = filter_frame(frame)
        except FrameError as error:
            _refused_log.warning(f"session {session_id}: dropped: {error}")
            if not tolerance.take():
                return 1008, "too many refused frames"
            continue
        try:
            await upstream.send(passed)
        except ConnectionClosed:
            return VIEWER_GONE, "the viewer is gone"
