"""The web process's application: pages, static files, two websockets, nothing else."""

import contextlib
from collections.abc import AsyncIterator, Sequence

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.responses import Response
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from app.web.config import ServerConfig
from app.web.input_socket import InputSockets
from app.web.pages import STATIC, Pages
from app.web.security import HostGuard
from app.web.sessions import SessionRegistry
from app.web.view_socket import ViewSockets
from app.web.workers import WorkerPool


class _Static(StaticFiles):
    """Files that a browser keeps but asks after, so that an upgrade shows at once."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers["cache-control"] = "no-cache"
        return response


def create_app(
    config: ServerConfig, workers: WorkerPool, routes: Sequence[BaseRoute] = ()
) -> Starlette:
    """The application; its lifespan opens and closes the workers.

    Args:
        config: Validated settings.
        workers: The pool that starts and ends worker processes.
        routes: Further routes of other rooms (studies, review), served behind the same guard;
            they come before our own, so that a study may serve its page at "/".
    """
    registry = SessionRegistry(config, workers)
    pages = Pages(registry, config)

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        await workers.open()
        registry.open()
        try:
            yield
        finally:
            await registry.close()

    application = Starlette(
        routes=[
            *routes,
            Route("/", pages.index),
            Route("/api/health", pages.health),
            Route("/watch/{key}", pages.watch),
            Route("/view/{id}/{path:path}", pages.viewer),
            WebSocketRoute("/view/{id}", ViewSockets(registry, config).endpoint),
            WebSocketRoute("/input/{id}", InputSockets(registry, config).endpoint),
            Mount("/static", _Static(directory=STATIC, check_dir=False)),
        ],
        middleware=[Middleware(HostGuard, config=config)],
        lifespan=lifespan,
    )
    application.state.registry = registry
    return application
