"""All browser sessions: found by cookie, started, ended a minute after their last page."""

import asyncio
import hmac
import logging
import time
from collections import OrderedDict

from app.session.spec import WorkerSpec
from app.web.config import ServerConfig
from app.web.housekeeping import complete_session
from app.web.limits import KeyedBuckets
from app.web.session import Session, StartRefusedError
from app.web.worker import Ending, Worker
from app.web.workers import WorkerPool

MAX_IDLE = 5000
"""Sessions without a worker that are remembered; the oldest is forgotten first."""
RESTARTS_PER_S = 0.05
RESTART_BURST = 4
"""Workers one session may start: a worker that dies at once must not be started in a circle."""

__all__ = ["SessionRegistry", "StartRefusedError"]
logger = logging.getLogger("hindsight.web")


class SessionRegistry:
    """Owns the sessions and their janitor."""

    def __init__(self, config: ServerConfig, workers: WorkerPool) -> None:
        self.workers = workers
        self._config = config
        self._by_id: OrderedDict[str, Session] = OrderedDict()
        self._restarts = KeyedBuckets(RESTARTS_PER_S, RESTART_BURST)
        self._janitor: asyncio.Task[None] | None = None
        self._chores: set[asyncio.Task[int]] = set()

    def open(self) -> None:
        """Begin to look after the sessions."""
        self._janitor = asyncio.get_running_loop().create_task(self._look_after())

    async def close(self) -> None:
        """End all sessions; their pages are told."""
        for session in self._by_id.values():
            session.say_ended("The server was stopped.")
        if self._janitor is not None:
            self._janitor.cancel()
            await asyncio.gather(self._janitor, return_exceptions=True)
        await self.workers.close()
        await asyncio.gather(*self._chores, return_exceptions=True)

    def issue(self) -> Session:
        """A new session, without a worker as yet."""
        return self.add(Session())

    def add(self, session: Session) -> Session:
        """Take in a session, also one of another room's kind."""
        self._by_id[session.id] = session
        if len(self._by_id) > MAX_IDLE:
            for other in self._by_id.values():
                if other.worker is None and not other.clients:
                    del self._by_id[other.id]
                    break
        return session

    def by_id(self, session_id: str) -> Session | None:
        """The session of this public id."""
        return self._by_id.get(session_id)

    def by_cookie(self, value: str | None) -> Session | None:
        """The session whose cookie this is."""
        session = self._by_id.get((value or "").partition(".")[0])
        return session if session and _same(value, session.cookie) else None

    def by_watch_key(self, value: str | None) -> Session | None:
        """The session of this read-only link."""
        session = self._by_id.get((value or "").partition(".")[0])
        return session if session and _same(value, session.watch_key) else None

    def ensure_worker(self, session: Session) -> None:
        """Start a worker where the session has none.

        Raises:
            PoolFullError: Where the machine bears no more.
            StartRefusedError: Where this session's workers ended too often of late.
        """
        if session.worker is not None:
            return
        if not self.workers.full and not self._restarts.take(session.start_key):
            raise StartRefusedError(
                "this session has been started too often in the last minute; wait a minute"
            )
        spec = session.worker_spec(self._config)

        def gone(worker: Worker, ending: Ending) -> None:
            session.worker_gone(worker, ending)
            self._complete_log(spec)  # one that could say goodbye may have lacked memory for it

        session.attach(self.workers.start(spec, session.receive, gone))

    def _complete_log(self, spec: WorkerSpec) -> None:
        """Finish what a worker left unfinished, beside the event loop."""
        task = asyncio.create_task(asyncio.to_thread(complete_session, spec))
        self._chores.add(task)
        task.add_done_callback(self._chores.discard)

    async def _look_after(self) -> None:
        while True:
            await asyncio.sleep(min(0.5, self._config.linger_s / 4 + 0.01))
            now_s = time.monotonic()
            for session in list(self._by_id.values()):
                session.hand_over()
                if session.has_owner or session.worker is None:
                    continue
                if now_s - session.touched_s > self._config.linger_s:
                    session.worker.end()


def _same(given: str | None, kept: str) -> bool:
    return hmac.compare_digest((given or "").encode(), kept.encode())
