"""The web process of `hindsight review`: its page, its data, its sockets, and nothing live."""

import contextlib
from collections.abc import AsyncIterator
from pathlib import Path

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

import app
from app.review.api import Api
from app.review.folder import ReviewFolder
from app.review.gate import Gate
from app.review.glance import Glances
from app.review.jobs import Jobs
from app.review.secret import Password
from app.review.sockets import ReviewSockets
from app.web.config import ServerConfig
from app.web.pages import STATIC
from app.web.security import HostGuard, host_of, page_policy
from app.web.sessions import SessionRegistry
from app.web.workers import WorkerPool

DEFAULT_PORT = 8081
_META = '<meta name="hindsight-session" content="">'


class _Static(StaticFiles):
    """Files that a browser keeps but asks after, so that an upgrade shows at once."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers["cache-control"] = "no-cache"
        return response


def review_config(folder: Path, host: str, port: int, public_origin: str) -> ServerConfig:
    """Settings of the web process.

    Raises:
        ConfigError: Naming the value and what is valid.
    """
    return ServerConfig(
        host=host,
        port=port,
        sessions=folder,
        public_origin=public_origin,
        worker_entry="app.review.worker:main",
        preload=("app.review.preload",),
        linger_s=3.0,
        # Opening a long trial whose cache cannot be kept takes a while without a word.
        status_timeout_s=180.0,
        starts_per_s=5.0,
        start_burst=8,
    )


def create_review_app(
    config: ServerConfig, folder: ReviewFolder, password: Password | None = None
) -> Starlette:
    """The application; its lifespan opens and closes workers and computations.

    Args:
        config: From `review_config`.
        folder: What is reviewed.
        password: Asked of everybody; None: nobody is asked.
    """
    workers = WorkerPool(config)
    registry = SessionRegistry(config, workers)
    gate = Gate(config, password)
    jobs, glances = Jobs(), Glances()
    sockets = ReviewSockets(registry, gate, folder)

    async def page(request: Request) -> Response:
        if gate.refusal(request):
            if request.headers.get("sec-fetch-site") in ("cross-site", "same-site"):
                # Strict cookies are not sent along a link from another site: ask again from here.
                return HTMLResponse('<!doctype html><meta http-equiv="refresh" content="0">')
            return RedirectResponse("/review/login", 303)
        text = (STATIC / "review.html").read_text(encoding="utf-8")
        text = text.replace(_META, _META.replace('""', f'"{registry.issue().id}"'), 1)
        headers = {"content-security-policy": page_policy(host_of(request))}
        response = HTMLResponse(text, headers=headers)
        if not gate.locked:
            gate.admit(request, response)
        return response

    async def home(_: Request) -> Response:
        return RedirectResponse("/review", 307)

    async def health(_: Request) -> Response:
        return JSONResponse({"status": "ok", "version": app.__version__, "views": workers.count})

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        await workers.open()
        registry.open()
        try:
            yield
        finally:
            glances.close()
            await jobs.close()
            await registry.close()

    application = Starlette(
        routes=[
            Route("/", home),
            Route("/review", page),
            Route("/review/login", gate.login, methods=["GET", "POST"]),
            Route("/api/health", health),
            *Api(folder, gate, jobs, glances).routes(),
            Route("/review/view/{id}/{view:int}", sockets.frame),
            WebSocketRoute("/review/view/{id}/{view:int}", sockets.view),
            WebSocketRoute("/review/socket/{id}", sockets.control),
            Mount("/static", _Static(directory=STATIC, check_dir=False)),
        ],
        middleware=[Middleware(HostGuard, config=config)],
        lifespan=lifespan,
    )
    application.state.registry = registry
    return application
