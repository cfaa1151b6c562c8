"""The participant's page: arrival by link, the page itself, withdrawal, the printed run sheet."""

import html

from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, RedirectResponse, Response

from app.study.server.cookies import (
    MAX_VALUE,
    arrival_of,
    forget,
    keep_arrival,
    keep_participant,
    participant_of,
)
from app.study.server.host import Host
from app.web.pages import STATIC
from app.web.security import host_of, page_policy

_CROSS_SITE = ("cross-site", "same-site")


class StudyPages:
    """The endpoints, with the host they serve."""

    def __init__(self, host: Host) -> None:
        self._host = host

    async def index(self, request: Request) -> Response:
        """The page; what the link carried is kept and taken out of the address."""
        if request.headers.get("sec-fetch-site") in _CROSS_SITE:
            # Strict cookies are not sent along a link from another site: ask once more from here.
            query = f"?{request.url.query}" if request.url.query else ""
            return _again(f"/{query}")
        if request.query_params:
            return self._arrive(request)
        return self._page(request, "study.html")

    async def withdraw(self, request: Request) -> Response:
        """Where a withdrawal code is typed."""
        return self._page(request, "study.html")

    def _arrive(self, request: Request) -> Response:
        host, query = self._host, request.query_params
        response = RedirectResponse("/", 303)
        arrival = host.store.study.arrival
        parameters = {
            name: value[:MAX_VALUE] for name in arrival.parameters if (value := query.get(name))
        }
        about = {**arrival_of(request, host), "at": 0}
        if parameters:
            about["parameters"] = parameters
        if host.store.test and query.get("fast") == "1":
            about["fast"] = True
        if query.get("pilot") and host.is_pilot_key(query["pilot"]):
            about["pilot"] = True
        resumed = host.store.by_token(query.get("resume", ""))
        if resumed is not None:
            token = host.store.renew_token(resumed.id)  # the link works once
            keep_participant(request, response, host, f"{resumed.id}.{token}")
            return response
        keep_arrival(request, response, host, about)
        person = participant_of(request, host)
        if "next" in query and (person is None or not person.state.is_open):
            forget(request, response, host, "study", "session")
        return response

    def _page(self, request: Request, name: str) -> Response:
        try:
            text = (STATIC / name).read_text(encoding="utf-8")
        except OSError as error:
            return PlainTextResponse(f"the page is missing: {error}\n", 500)
        theme = self._host.store.study.theme
        text = text.replace('data-theme="dark"', f'data-theme="{theme}"', 1)
        return HTMLResponse(
            text, headers={"content-security-policy": page_policy(host_of(request))}
        )


def _again(path: str) -> Response:
    return HTMLResponse(
        '<!doctype html><meta charset="utf-8"><title>Study</title>'
        f'<meta http-equiv="refresh" content="0;url={html.escape(path)}">'
    )
