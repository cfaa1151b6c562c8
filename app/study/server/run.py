"""`hindsight study STUDY.yaml`: host a study until told to stop."""

import logging
from dataclasses import dataclass

from starlette.applications import Starlette
from starlette.routing import Route

from app.study.load import load_study, study_path
from app.study.lock import lock_study
from app.study.server.api import Api
from app.study.server.desk import Desk
from app.study.server.host import Host
from app.study.server.pages import StudyPages
from app.study.server.password import read_hash
from app.study.store import Store
from app.study.tables import copy_study_file, write_tables
from app.web.config import ServerConfig
from app.web.housekeeping import complete_logs
from app.web.run import HindsightServer, address, bind, serve_until_signal
from app.web.server import create_app
from app.web.workers import WorkerPool

logger = logging.getLogger("hindsight.study")


@dataclass(frozen=True)
class HostOptions:
    """How a study is hosted.

    Attributes:
        study: A shipped study's name, or the path of a study file.
        config: The server's settings; `config.study` is taken from the file.
        test: Whether data are marked as those of a test run.
    """

    study: str
    config: ServerConfig
    test: bool = False


def make_application(host: Host) -> Starlette:
    """The web application of a study: its page in place of the live one."""
    api, pages, desk = Api(host), StudyPages(host), Desk(host)
    routes = [
        Route("/", pages.index),
        Route("/withdraw", pages.withdraw),
        Route("/api/study", api.get, methods=["GET"]),
        Route("/api/study", api.post, methods=["POST"]),
        Route("/desk", desk.page),
        Route("/desk/watch/{id}", desk.watch),
        Route("/desk/download", desk.download),
        Route("/api/desk", desk.get, methods=["GET"]),
        Route("/api/desk", desk.post, methods=["POST"]),
    ]
    application = create_app(host.config, WorkerPool(host.config), routes)
    host.registry = application.state.registry
    return application


def host_study(options: HostOptions) -> None:
    """Serve until SIGINT or SIGTERM.

    Raises:
        AppError: If the study, its folder or the port cannot be used.
    """
    path = study_path(options.study)
    study = load_study(path)
    logging.basicConfig(format="%(asctime)s %(name)s %(levelname)s: %(message)s")
    for name in ("hindsight.study", "hindsight.web"):
        logging.getLogger(name).setLevel(logging.INFO)
    config = options.config
    with lock_study(config.sessions, study.name), bind(config) as listener:
        complete_logs(config.sessions)
        store = Store(study, config.sessions, test=options.test)
        try:
            copy_study_file(store, path)
            host = Host(store, config)
            host.resolve_all()
            write_tables(store)
            url = address(config, listener)
            application = make_application(host)
            print(f"The study {study.name!r} is at {url}  (Ctrl+C ends it)", flush=True)
            print(f"Pilots, who do not count: {url}/?pilot={host.pilot_key}", flush=True)
            desk = "" if read_hash(config.sessions) else " (first: hindsight study password)"
            print(f"The experimenter's desk: {url}/desk{desk}", flush=True)
            if options.test:
                print(f"Test run, data are marked; short: {url}/?fast=1", flush=True)
            serve_until_signal(HindsightServer(config, application), listener)
        finally:
            store.close()
