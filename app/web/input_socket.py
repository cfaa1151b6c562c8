"""`WS /input/{id}`: what the person does goes to the worker, what the worker says comes back."""

import asyncio
import contextlib
import logging
import time

from starlette.websockets import WebSocket, WebSocketDisconnect

from app.web.access import Access, check_socket, deny
from app.web.config import ServerConfig
from app.web.limits import QuietLog, TokenBucket
from app.web.messages import (
    BrowserMessage,
    Command,
    InputMessage,
    MessageError,
    PingMessage,
    parse_message,
)
from app.web.outbox import Close
from app.web.session import Client, Session, to_json
from app.web.sessions import SessionRegistry, StartRefusedError
from app.web.workers import PoolFullError

MESSAGES_PER_S = 240.0
"""Four times what a page sends; what comes faster is dropped [1/s]."""
MAX_FAULTS = 40
"""Malformed or dropped messages beyond which a socket is closed; they wear off at 1 a second."""
MAX_CLIENTS = 16
"""Open pages of one session."""
POLICY_VIOLATION = 1008
TRY_LATER = 4003
"""Websocket close code where no simulation can be started at present."""

logger = logging.getLogger("hindsight.web")
_refused_log = QuietLog(logger)
_malformed_log = QuietLog(logger)


class InputSockets:
    """The endpoint, with the registry it serves."""

    def __init__(self, registry: SessionRegistry, config: ServerConfig) -> None:
        self._registry = registry
        self._config = config

    async def endpoint(self, socket: WebSocket) -> None:
        """One connection, from its handshake to its end."""
        access = check_socket(socket, self._registry, self._config)
        if isinstance(access, str):
            _refused_log.warning(f"refused an input socket: {access}")
            await deny(socket, 403, access)
        elif len(access.session.clients) >= MAX_CLIENTS:
            await deny(socket, 429, f"{MAX_CLIENTS} pages of this session are open; close one")
        else:
            await self._serve(socket, access)

    async def _serve(self, socket: WebSocket, access: Access) -> None:
        session = access.session
        await socket.accept()
        if access.role == "owner":
            try:
                self._registry.ensure_worker(session)
            except (PoolFullError, StartRefusedError) as error:
                await socket.send_text(to_json({"type": "ended", "reason": f"{error}"}))
                await socket.close(TRY_LATER, str(error)[:120])
                return
        elif session.worker is None:
            text = "The session to watch is not running."
            await socket.send_text(to_json({"type": "ended", "reason": text}))
            await socket.close(TRY_LATER, text)
            return
        client = session.join(access.role)
        writing = asyncio.create_task(_write(socket, client))
        try:
            await _Reader(session, client).read(socket)
        finally:
            session.leave(client)
            client.outbox.close(1001, "going away")
            with contextlib.suppress(asyncio.CancelledError, TimeoutError):
                await asyncio.wait_for(writing, 2.0)


async def _write(socket: WebSocket, client: Client) -> None:
    """Send what waits in the client's outbox until it says close, or the browser is gone."""
    with contextlib.suppress(WebSocketDisconnect, OSError, RuntimeError):
        while True:
            item = await client.outbox.next()
            if isinstance(item, Close):
                await socket.close(item.code, item.reason)
                return
            await socket.send_text(item)


class _Reader:
    """Judges and forwards the messages of one page."""

    def __init__(self, session: Session, client: Client) -> None:
        self._session = session
        self._client = client
        self._rate = TokenBucket(MESSAGES_PER_S, MESSAGES_PER_S)
        self._faults = TokenBucket(1.0, MAX_FAULTS)
        self._last_seq = -1

    async def read(self, socket: WebSocket) -> None:
        """Read until the browser is gone or misbehaves for too long."""
        while True:
            try:
                frame = await socket.receive()
            except RuntimeError:  # closed by our own writer
                return
            if frame["type"] == "websocket.disconnect":
                return
            self._client.heard_s = time.monotonic()
            if not self._rate.take():
                complaint = f"more than {MESSAGES_PER_S:.0f} messages a second"
                tolerated = self._faults.take(0.1)
            else:
                complaint = self._handle(frame.get("text"))
                tolerated = not complaint or self._faults.take()
            if not tolerated:
                _malformed_log.warning(f"session {self._session.id} is disconnected: {complaint}")
                self._client.outbox.close(POLICY_VIOLATION, complaint[:100])
                return

    def _handle(self, text: str | None) -> str:
        """Act on one frame; returns the complaint, empty where it was fine."""
        try:
            if text is None:
                raise MessageError("a binary frame; valid: text frames of JSON")
            self._dispatch(parse_message(text))
        except MessageError as error:
            _malformed_log.warning(f"session {self._session.id}: {error}")
            if error.command_id is not None:
                answer = {"type": "ack", "id": error.command_id, "error": str(error)}
            else:
                answer = {"type": "error", "text": str(error)}
            self._client.outbox.put(to_json(answer))
            return str(error)
        return ""

    def _dispatch(self, message: BrowserMessage) -> None:
        session, client = self._session, self._client
        controls = session.control is client
        if isinstance(message, PingMessage):
            client.outbox.put(to_json({"type": "pong", "t": message.t}))
            if controls and message.rtt is not None and session.worker is not None:
                session.worker.send_latest("rtt", {"type": "rtt", "ms": message.rtt})
        elif session.worker is None:
            return  # it has ended, and the page is being told
        elif isinstance(message, InputMessage):
            if controls and message.seq > self._last_seq:  # neither replayed nor overtaken
                self._last_seq = message.seq
                session.worker.send_latest("input", _addressed(message, client))
        elif not controls:
            self._refuse(message, "this page only watches; another one controls")
        elif not session.worker.send(_addressed(message, client)):
            self._refuse(message, "the simulation takes no commands at present")

    def _refuse(self, message: BrowserMessage, text: str) -> None:
        """Answer a well-formed command that cannot be passed on."""
        if isinstance(message, Command):
            answer = {"type": "ack", "id": message.id, "error": text}
            self._client.outbox.put(to_json(answer))


def _addressed(message: BrowserMessage, client: Client) -> dict[str, object]:
    return {**message.model_dump(exclude_none=True), "client": client.name}
