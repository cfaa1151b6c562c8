"""Which session a request may reach, and as what."""

from dataclasses import dataclass

from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse
from starlette.websockets import WebSocket

from app.web.config import ServerConfig
from app.web.security import check_origin, cookie_name
from app.web.session import Role, Session
from app.web.sessions import SessionRegistry


@dataclass(frozen=True)
class Access:
    """A session and the role in which it may be used."""

    session: Session
    role: Role


def find_access(
    connection: HTTPConnection, registry: SessionRegistry, config: ServerConfig, session_id: str
) -> Access | None:
    """What the cookies of a request allow for this session; None: nothing."""
    own = registry.by_cookie(connection.cookies.get(cookie_name(connection, config)))
    if own is not None and own.id == session_id:
        return Access(own, "owner")
    watched = registry.by_watch_key(
        connection.cookies.get(cookie_name(connection, config, "watch"))
    )
    if watched is not None and watched.id == session_id:
        return Access(watched, "watcher")
    return None


def check_socket(
    socket: WebSocket, registry: SessionRegistry, config: ServerConfig
) -> Access | str:
    """What a websocket handshake may reach, or in words why it may not."""
    complaint = check_origin(socket, config)
    if complaint:
        return complaint
    session_id = socket.path_params["id"]
    access = find_access(socket, registry, config, session_id)
    return access or f"no cookie for session {session_id!r}; reload the page"


async def deny(socket: WebSocket, status: int, text: str) -> None:
    """Refuse a websocket handshake with a plain answer."""
    await socket.send_denial_response(PlainTextResponse(text + "\n", status))
