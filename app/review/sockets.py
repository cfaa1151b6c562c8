"""The review's websockets: one that carries seeks and commands, one for each 3-D view."""

import asyncio
import contextlib
from typing import Any

import msgspec
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.websockets import WebSocket, WebSocketDisconnect

from app.errors import AppError
from app.review.errors import MissingError, ReviewError
from app.review.folder import ReviewFolder
from app.review.gate import Gate
from app.web.access import deny
from app.web.outbox import Close
from app.web.security import host_of, viewer_policy
from app.web.session import Client, Session, to_json
from app.web.sessions import SessionRegistry, StartRefusedError
from app.web.view_socket import proxy_view
from app.web.viewer_page import subprotocol, viewer_page
from app.web.workers import PoolFullError

READY_WAIT_S = 4.0
"""viser's client gives a handshake up after 5 s and tries again."""
TRY_LATER = 4003
"""Close code where no view can be started at present."""
MAX_VIEWS = 4
COMMANDS = ("views", "open", "path", "layers", "theme", "detail", "camera")


class Seek(msgspec.Struct, frozen=True, tag="seek", tag_field="type"):
    """Show this step; only the newest wish of each view counts."""

    step: int
    view: int = 0


class Ask(msgspec.Struct, frozen=True, kw_only=True, tag="command", tag_field="type"):
    """A command of the page; answered by an ack with its id."""

    id: int
    name: str
    view: int = 0
    trial: str = ""
    count: int = 0
    points: list[float] = []
    changes: dict[str, bool | str] = {}
    preset: str = ""
    theme: str = ""
    detail: str = ""


_decoder = msgspec.json.Decoder(Seek | Ask)


class ReviewSockets:
    """The endpoints, with the pages they serve."""

    def __init__(self, registry: SessionRegistry, gate: Gate, folder: ReviewFolder) -> None:
        self._registry, self._gate, self._folder = registry, gate, folder

    async def frame(self, request: Request) -> Response:
        """Serve viser's client for the frame of one view."""
        if not self._gate.knows(request) or self._session(request.path_params["id"]) is None:
            return PlainTextResponse("open the page first\n", 403)
        page, tag = viewer_page()
        headers = {
            "content-security-policy": viewer_policy(host_of(request)),
            "cache-control": "private, no-cache",
            "etag": tag,
        }
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers=headers)
        return HTMLResponse(page, headers=headers)

    async def view(self, socket: WebSocket) -> None:
        """The socket of one view's client."""
        session = await self._admitted(socket)
        if session is None:
            return
        number = socket.path_params["view"]
        if subprotocol() not in (socket.scope.get("subprotocols") or []):
            await deny(socket, 400, f"valid subprotocol: {subprotocol()}")
            return
        worker = session.worker
        if worker is not None:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(worker.ready.wait(), READY_WAIT_S)
        ports = worker.hello.get("views", []) if worker is not None and worker.alive else []
        if not 0 <= number < len(ports):
            await deny(socket, 503, "this view is not there yet")
            return
        await proxy_view(socket, ports[number], session.id)

    async def control(self, socket: WebSocket) -> None:
        """The page's own socket, from its handshake to its end."""
        session = await self._admitted(socket)
        if session is None:
            return
        await socket.accept()
        try:
            self._registry.ensure_worker(session)
        except (PoolFullError, StartRefusedError) as error:
            await socket.send_text(to_json({"type": "ended", "reason": str(error)}))
            await socket.close(TRY_LATER, str(error)[:120])
            return
        client = session.join("owner")
        writing = asyncio.create_task(_write(socket, client))
        try:
            await self._read(socket, session, client)
        finally:
            session.leave(client)
            client.outbox.close(1001, "going away")
            with contextlib.suppress(asyncio.CancelledError, TimeoutError):
                await asyncio.wait_for(writing, 2.0)

    def _session(self, session_id: str) -> Session | None:
        return self._registry.by_id(session_id)

    async def _admitted(self, socket: WebSocket) -> Session | None:
        """The page's session; None where the handshake was refused."""
        complaint = self._gate.refusal_to_act(socket)
        session = self._session(socket.path_params["id"])
        if complaint or session is None:
            await deny(socket, 403, complaint or "this page is too old; load it again")
            return None
        return session

    async def _read(self, socket: WebSocket, session: Session, client: Client) -> None:
        while True:
            try:
                frame = await socket.receive()
            except RuntimeError:  # closed by our own writer
                return
            if frame["type"] == "websocket.disconnect":
                return
            try:
                message = _decoder.decode(frame.get("text") or "")
            except (ValueError, RecursionError) as error:
                text = f"this is no message of the review: {error}"
                client.outbox.put(to_json({"type": "error", "text": text}))
                continue
            if isinstance(message, Seek):
                self._seek(session, message)
            else:
                self._command(session, client, message)

    def _seek(self, session: Session, seek: Seek) -> None:
        if session.worker is not None and 0 <= seek.view < MAX_VIEWS:
            message = {"type": "seek", "view": seek.view, "step": seek.step}
            session.worker.send_latest(f"seek-{seek.view}", message)

    def _command(self, session: Session, client: Client, ask: Ask) -> None:
        error = ""
        try:
            message: dict[str, Any] = {**msgspec.to_builtins(ask), "client": client.name}
            if ask.name not in COMMANDS:
                raise ReviewError(f"command {ask.name!r} is unknown; valid: {', '.join(COMMANDS)}")
            if ask.name == "open":
                message["path"] = str(self._folder.finished(ask.trial))
                if session.worker is not None:
                    session.worker.discard(f"seek-{ask.view}")
            if session.worker is None or not session.worker.send(message):
                raise MissingError("the view takes no commands at present")
        except AppError as refusal:
            error = str(refusal).replace(f"{self._folder.root}/", "")
        if error:
            client.outbox.put(to_json({"type": "ack", "id": ask.id, "error": error}))


async def _write(socket: WebSocket, client: Client) -> None:
    """Send what waits in the client's outbox until it says close, or the browser is gone."""
    with contextlib.suppress(WebSocketDisconnect, OSError, RuntimeError):
        while True:
            item = await client.outbox.next()
            if isinstance(item, Close):
                await socket.close(item.code, item.reason)
                return
            await socket.send_text(item)
