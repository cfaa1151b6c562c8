"""Who may review: anybody at this machine; from elsewhere who knows the password."""

import asyncio
import hmac
import html
import secrets
from pathlib import Path
from urllib.parse import parse_qs

from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, PlainTextResponse, RedirectResponse, Response

from app.review.secret import Password
from app.web.config import ServerConfig
from app.web.limits import TokenBucket
from app.web.security import check_origin, cookie_name, host_of, page_policy, set_cookie

LOGIN = Path(__file__).with_name("login.html")
GUESSES_PER_S, GUESS_BURST = 0.2, 10.0
MAX_FORM_BYTES = 4096
KIND = "review"
"""Of the cookie."""


class Gate:
    """Gives a cookie to those who may review, and knows it again.

    The cookie is a key drawn when the server starts. At the machine itself the page hands it out;
    behind a proxy only the login does.
    """

    def __init__(self, config: ServerConfig, password: Password | None) -> None:
        self._config = config
        self._password = password
        self._key = secrets.token_urlsafe(32)
        self._guesses = TokenBucket(GUESSES_PER_S, GUESS_BURST)

    @property
    def locked(self) -> bool:
        """Whether a password is asked for."""
        return self._password is not None

    def knows(self, connection: HTTPConnection) -> bool:
        """Whether the request carries the key."""
        given = connection.cookies.get(cookie_name(connection, self._config, KIND), "")
        return hmac.compare_digest(given.encode(), self._key.encode())

    def refusal(self, connection: HTTPConnection) -> str:
        """Why a request may not read; empty where it may."""
        if self.locked and not self.knows(connection):
            return "log in first: this review is behind a password"
        return ""

    def refusal_to_act(self, connection: HTTPConnection) -> str:
        """Why a request may not change anything or open a socket; empty where it may."""
        if not self.knows(connection):
            return "no cookie of this review; open the page first"
        return check_origin(connection, self._config)

    def admit(self, connection: HTTPConnection, response: Response) -> None:
        """Hand out the key."""
        name = cookie_name(connection, self._config, KIND)
        set_cookie(response, name, self._key, self._config)

    async def login(self, request: Request) -> Response:
        """The form, and what it sends."""
        if self._password is None:
            return RedirectResponse("/review", 303)
        if request.method == "GET":
            return self._form(request, "", 200)
        complaint = check_origin(request, self._config)
        if complaint:
            return PlainTextResponse(complaint + "\n", 403)
        if not self._guesses.take():
            return self._form(request, "Too many attempts; wait a few seconds.", 429)
        body = await request.body()
        if len(body) > MAX_FORM_BYTES:
            return self._form(request, "That is too long for a password.", 413)
        password = parse_qs(body.decode("utf-8", "replace")).get("password", [""])[0]
        if not await asyncio.to_thread(self._password.matches, password):
            return self._form(request, "That is not the password.", 403)
        response = RedirectResponse("/review", 303)
        self.admit(request, response)
        return response

    def _form(self, request: Request, message: str, status: int) -> Response:
        text = LOGIN.read_text(encoding="utf-8").replace("{message}", html.escape(message))
        headers = {"content-security-policy": page_policy(host_of(request))}
        return HTMLResponse(text, status, headers=headers)
