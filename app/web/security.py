"""Who may ask, and what every answer carries: hosts, origins, cookies, headers."""

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.web.config import LOOPBACK_HOSTS, ServerConfig

_COMMON = {
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=(), gamepad=(self)",
}


def page_policy(host: str) -> str:
    """Content security policy of our own pages: everything from this server, nothing inline."""
    return (
        "default-src 'none'; script-src 'self'; style-src 'self'; style-src-attr 'unsafe-inline'; "
        f"img-src 'self' data: blob:; connect-src 'self' ws://{host} wss://{host}; "
        "font-src 'self'; frame-src 'self'; manifest-src 'self'; base-uri 'none'; "
        "form-action 'self'; frame-ancestors 'none'"
    )


def viewer_policy(host: str) -> str:
    """Policy of viser's client, which unpacks itself into inline scripts, blobs and WebAssembly.

    It may neither evaluate text (so the server cannot send it scripts) nor talk to another host
    (so its `?websocket=` and `?playbackPath=` lead nowhere).
    """
    return (
        "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; "
        "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; worker-src blob:; "
        f"connect-src ws://{host} wss://{host} data: blob:; base-uri 'none'; "
        "form-action 'none'; frame-ancestors 'self'"
    )


def host_of(connection: HTTPConnection) -> str:
    """The Host header, name and port; checked by `HostGuard` before anything else runs."""
    return connection.headers.get("host", "")


def check_origin(connection: HTTPConnection, config: ServerConfig) -> str:
    """Why a websocket handshake does not come from our own page; empty where it does."""
    origin = connection.headers.get("origin")
    valid = config.public_origin or f"http://{host_of(connection)}"
    return "" if origin == valid else f"origin is {origin!r}; valid: {valid}"


def cookie_name(connection: HTTPConnection, config: ServerConfig, kind: str = "session") -> str:
    """Name of a cookie.

    Cookies are shared between the ports of a host, so the name holds the port; the prefix
    __Host- makes a browser refuse one that came without encryption or from another host.
    """
    if config.behind_tls_proxy:
        return f"__Host-hindsight-{kind}"
    return f"hindsight-{kind}-{_split(host_of(connection))[1] or '80'}"


def set_cookie(response: Response, name: str, value: str, config: ServerConfig) -> None:
    """A cookie that scripts cannot read and other sites cannot cause to be sent."""
    response.set_cookie(
        name, value, path="/", httponly=True, samesite="strict", secure=config.behind_tls_proxy
    )


class HostGuard:
    """Answers only to our own names, and adds the common headers to every answer.

    Another site could otherwise bind its own name to this server (DNS rebinding).
    """

    def __init__(self, app: ASGIApp, config: ServerConfig) -> None:
        self._app = app
        self._names = set(LOOPBACK_HOSTS)
        self._public_host = config.public_origin.removeprefix("https://").lower()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request or websocket."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] in ("http.response.start", "websocket.http.response.start"):
                headers = MutableHeaders(scope=message)
                for name, value in _COMMON.items():
                    headers.setdefault(name, value)
                headers.setdefault("cache-control", "no-store")
            await send(message)

        host = Headers(scope=scope).get("host", "").lower()
        if _split(host)[0] in self._names or (self._public_host and host == self._public_host):
            await self._app(scope, receive, send_with_headers)
            return
        names = ", ".join([*LOOPBACK_HOSTS, *filter(None, [self._public_host])])
        answer = PlainTextResponse(f"host is {host!r}; valid: {names}\n", 421)
        await answer(scope, receive, send_with_headers)


def _split(host: str) -> tuple[str, str]:
    """Name and port of a Host header, without the brackets of IPv6."""
    if host.startswith("["):
        name, _, rest = host[1:].partition("]")
        return name, rest.removeprefix(":")
    name, _, port = host.partition(":")
    return name, port
