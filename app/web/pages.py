"""What is fetched by GET: the page, the viewer's frame, the read-only link, the health report."""

import html
from pathlib import Path

from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, Response

import app
from app.web.access import find_access
from app.web.config import ServerConfig
from app.web.security import cookie_name, host_of, page_policy, set_cookie, viewer_policy
from app.web.session import Session
from app.web.sessions import SessionRegistry
from app.web.viewer_page import viewer_page

STATIC = Path(app.__file__).parent.parent / "static"
_META = '<meta name="hindsight-session" content="">'
_FULL = Path(__file__).with_name("full.html")
_CROSS_SITE = ("cross-site", "same-site")


class Pages:
    """The endpoints, with the registry they serve."""

    def __init__(self, registry: SessionRegistry, config: ServerConfig) -> None:
        self._registry = registry
        self._config = config

    async def index(self, request: Request) -> Response:
        """The page, for the browser's own session or for one it may watch."""
        name = cookie_name(request, self._config)
        own = self._registry.by_cookie(request.cookies.get(name))
        watched = request.query_params.get("watch")
        if watched:
            access = find_access(request, self._registry, self._config, watched)
            if access is None:
                text = f"There is no session {watched!r} to watch, or the link was not opened here."
                return PlainTextResponse(text + "\n", 403)
            return self._page(request, access.session)
        if own is None and request.headers.get("sec-fetch-site") in _CROSS_SITE:
            # Strict cookies are not sent along a link from another site: ask once more from here.
            return _ask_again("/?" + request.url.query if request.url.query else "/")
        if (own is None or own.worker is None) and self._registry.workers.full:
            return self._full_page(request)
        session = own or self._registry.issue()
        response = self._page(request, session)
        if own is None:
            set_cookie(response, name, session.cookie, self._config)
        return response

    async def watch(self, request: Request) -> Response:
        """The read-only link: a cookie that opens one session for watching."""
        session = self._registry.by_watch_key(request.path_params["key"])
        if session is None:
            return PlainTextResponse("This link belongs to no session that still runs.\n", 404)
        response = _ask_again(f"/?watch={session.id}")
        name = cookie_name(request, self._config, "watch")
        set_cookie(response, name, session.watch_key, self._config)
        return response

    async def viewer(self, request: Request) -> Response:
        """The client of viser, for the frame in our page."""
        session_id = request.path_params["id"]
        if find_access(request, self._registry, self._config, session_id) is None:
            text = f"no cookie for session {session_id!r}; open the page first"
            return PlainTextResponse(text + "\n", 403)
        if request.path_params.get("path"):
            return PlainTextResponse("viser's client is one file\n", 404)
        page, tag = viewer_page()
        headers = {
            "content-security-policy": viewer_policy(host_of(request)),
            "cache-control": "private, no-cache",
            "etag": tag,
        }
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers=headers)
        return HTMLResponse(page, headers=headers)

    async def health(self, request: Request) -> Response:
        """For monitors: whether it serves, and how much room there is."""
        pool = self._registry.workers
        return JSONResponse(
            {
                "status": "full" if pool.full else "ok",
                "version": app.__version__,
                "sessions": pool.count,
                "capacity": pool.capacity,
            }
        )

    def _page(self, request: Request, session: Session) -> Response:
        try:
            text = (STATIC / "index.html").read_text(encoding="utf-8")
        except OSError as error:
            return PlainTextResponse(f"the page is missing: {error}\n", 500)
        text = text.replace(_META, _META.replace('""', f'"{session.id}"'), 1)
        return HTMLResponse(
            text, headers={"content-security-policy": page_policy(host_of(request))}
        )

    def _full_page(self, request: Request) -> Response:
        capacity = self._registry.workers.capacity
        title = "The one place is taken" if capacity == 1 else f"All {capacity} places are taken"
        number = "one" if capacity == 1 else f"{capacity} of them"
        why = f"Each place is a whole simulated robot, and this machine runs {number} well."
        text = _FULL.read_text(encoding="utf-8").replace("{title}", title).replace("{why}", why)
        headers = {"content-security-policy": page_policy(host_of(request)), "retry-after": "10"}
        return HTMLResponse(text, 503, headers=headers)


def _ask_again(path: str) -> Response:
    """A page of ours that goes on by itself, so that the next request comes from our own site."""
    return HTMLResponse(
        '<!doctype html><meta charset="utf-8"><title>Hindsight</title>'
        f'<meta http-equiv="refresh" content="0;url={html.escape(path)}">'
    )
