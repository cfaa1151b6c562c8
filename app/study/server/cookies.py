"""Who a request comes from: the participant's cookie, and what a link carried before consent."""

import base64
import hashlib
import hmac
import time
from typing import Any

import msgspec
from starlette.requests import Request
from starlette.responses import Response

from app.study.server.host import Host
from app.study.store import Person
from app.web.security import cookie_name, set_cookie

STAYS_S = 60 * 86400
"""How long a browser keeps its place in the study [s]."""
LEFT = "left"
MAX_VALUE = 200


def participant_of(request: Request, host: Host) -> Person | None:
    """The participant whose cookie the request carries."""
    return host.store.by_token(_get(request, host, "study"))


def has_left(request: Request, host: Host) -> bool:
    """Whether this browser's participant has withdrawn."""
    return _get(request, host, "study") == LEFT


def keep_participant(request: Request, response: Response, host: Host, value: str) -> None:
    """Give the browser its cookie, which outlives the browser's own end."""
    response.set_cookie(
        cookie_name(request, host.config, "study"),
        value,
        max_age=STAYS_S,
        path="/",
        httponly=True,
        samesite="strict",
        secure=host.config.behind_tls_proxy,
    )


def keep_session(request: Request, response: Response, host: Host, person: Person) -> None:
    """Let the browser reach the robot of its participant, and no other."""
    session = host.session(person.id)
    name = cookie_name(request, host.config)
    if request.cookies.get(name) != session.cookie:
        set_cookie(response, name, session.cookie, host.config)


def keep_arrival(request: Request, response: Response, host: Host, about: dict[str, Any]) -> None:
    """Keep what a link carried in the browser itself until there is consent, signed."""
    body = base64.urlsafe_b64encode(msgspec.json.encode({**about, "at": int(time.time())}))
    value = f"{body.decode()}.{_sign(host, body)}"
    set_cookie(response, cookie_name(request, host.config, "arrival"), value, host.config)


def arrival_of(request: Request, host: Host) -> dict[str, Any]:
    """What `keep_arrival` kept; empty where there is nothing, or it was tampered with."""
    body, _, signature = _get(request, host, "arrival").partition(".")
    if not body or not hmac.compare_digest(_sign(host, body.encode()), signature):
        return {}
    return msgspec.json.decode(base64.urlsafe_b64decode(body))


def forget(request: Request, response: Response, host: Host, *kinds: str) -> None:
    """Delete cookies of ours."""
    for kind in kinds:
        response.delete_cookie(
            cookie_name(request, host.config, kind),
            path="/",
            httponly=True,
            samesite="strict",
            secure=host.config.behind_tls_proxy,
        )


def _get(request: Request, host: Host, kind: str) -> str:
    return request.cookies.get(cookie_name(request, host.config, kind), "")


def _sign(host: Host, body: bytes) -> str:
    return hmac.new(host.signing_key, body, hashlib.sha256).hexdigest()
