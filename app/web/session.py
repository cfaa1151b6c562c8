"""One browser session: who is connected, who controls, and the worker behind it."""

import logging
import secrets
import time
from typing import Any, Literal

import msgspec

from app import __version__
from app.errors import AppError
from app.session.spec import WorkerSpec
from app.web.channel import Head
from app.web.config import ServerConfig
from app.web.outbox import Outbox
from app.web.worker import Ending, Worker

Role = Literal["owner", "watcher"]
"""owner: holds the session's cookie. watcher: came by the read-only link."""

GONE_CODE = 4001
"""Websocket close code after `ended`; a new connection starts the simulation anew."""
SILENT_S = 2.5
"""A page in control pings every second; silent for this long it loses control to a new page [s]."""
HANDOVER_S = 3.0
"""A page that watched takes over when the page in control has been gone for this long [s]."""

logger = logging.getLogger("hindsight.web")


class StartRefusedError(AppError):
    """This session may not start a worker now."""


class Client:
    """One open page of a session."""

    def __init__(self, name: str, role: Role) -> None:
        self.name = name
        self.role: Role = role
        self.outbox = Outbox()
        self.heard_s = time.monotonic()


class Session:
    """Belongs to one browser (cookie); outlives its pages and its workers."""

    def __init__(self) -> None:
        self.id = secrets.token_hex(5)
        """In paths and file names; no secret."""
        self.cookie = f"{self.id}.{secrets.token_urlsafe(32)}"
        """Value of the owner's cookie."""
        self.watch_key = f"{self.id}.{secrets.token_urlsafe(16)}"
        """Opens the session for watching."""
        self.touched_s = time.monotonic()
        """When a page of the owner was last open or asked for [s]."""
        self.worker: Worker | None = None
        self.runs = 0
        """Workers started so far."""
        self.clients: dict[str, Client] = {}
        self.control: Client | None = None
        self.shares_watch = True
        """Whether its own page is told the read-only link."""
        self.sockets = 0
        """Open view sockets."""
        self._joined = 0
        self._control_lost_s = float("-inf")

    @property
    def start_key(self) -> str:
        """What the bound on worker starts counts by."""
        return self.id

    def worker_spec(self, config: ServerConfig) -> WorkerSpec:
        """What the next worker is told; studies decide this themselves.

        Raises:
            StartRefusedError: If there is nothing to run now.
        """
        return WorkerSpec(
            id=self.id,
            scene=config.scene,
            settings=dict(config.settings),
            sessions=str(config.sessions),
            study=config.study,
            participant=self.id,
            session=str(self.runs + 1),
            options={**config.options, "watch": self.watch_path},
        )

    @property
    def watch_path(self) -> str:
        """The read-only link, for a projector."""
        return f"/watch/{self.watch_key}"

    @property
    def has_owner(self) -> bool:
        """Whether a page of the owner is connected."""
        return any(client.role == "owner" for client in self.clients.values())

    def join(self, role: Role) -> Client:
        """Add a page; the first of the owner controls, later ones watch.

        A page in control that has fallen silent (a half-open connection, a sleeping tab) yields
        to a new one of the same browser.
        """
        self._joined += 1
        client = Client(f"c{self._joined}", role)
        self.clients[client.name] = client
        self.touched_s = time.monotonic()
        silent = self.control and time.monotonic() - self.control.heard_s > SILENT_S
        if role == "owner" and (self.control is None or silent):
            self._give_control(client)
        else:
            self._tell_clients()
            self._say_hello(client)
        return client

    def leave(self, client: Client) -> None:
        """Remove a page; when it was in control, the worker learns that nobody is."""
        self.clients.pop(client.name, None)
        if client.role == "owner":
            self.touched_s = time.monotonic()
        if self.control is client:
            self.control = None
            self._control_lost_s = time.monotonic()
            if self.worker is not None:
                self.worker.discard("input")
        self._tell_clients()

    def hand_over(self) -> None:
        """Give control to a page that watched, if the one in control has been gone for a while."""
        if self.control is None and time.monotonic() - self._control_lost_s > HANDOVER_S:
            owners = [client for client in self.clients.values() if client.role == "owner"]
            if owners:
                self._give_control(owners[0])

    def attach(self, worker: Worker) -> None:
        """Connect a worker that starts."""
        self.worker = worker
        self.runs += 1
        self._tell_clients()

    def receive(self, head: Head, text: str) -> None:
        """A message of the worker: pass it on to whom it concerns."""
        if head.type == "status":
            for client in self.clients.values():
                client.outbox.put_status(text)
        elif head.type in ("ready", "hello"):
            for client in self.clients.values():
                self._say_hello(client)
        elif head.type == "ack":
            if head.client in self.clients:
                self.clients[head.client].outbox.put(text)
        elif head.type in ("notice", "ended"):
            self._broadcast(text)

    def worker_gone(self, worker: Worker, ending: Ending) -> None:
        """The process has ended: say so once, and close the pages' sockets."""
        if self.worker is not worker:
            return
        self.worker = None
        if ending.announced:
            for client in self.clients.values():
                client.outbox.close(GONE_CODE, "ended")
        else:
            self.say_ended(ending.text)

    def say_ended(self, reason: str) -> None:
        """Tell every page that this is the end, and close its socket."""
        for client in self.clients.values():
            client.outbox.put(to_json({"type": "ended", "reason": reason}))
            client.outbox.close(GONE_CODE, "ended")

    def say(self, level: Literal["info", "warn", "error"], text: str) -> None:
        """Tell every page something."""
        self._broadcast(to_json({"type": "notice", "level": level, "text": text}))

    def _give_control(self, client: Client) -> None:
        previous, self.control = self.control, client
        if self.worker is not None:
            self.worker.discard("input")
        self._tell_clients()
        self._say_hello(client)
        if previous is not None and previous.name in self.clients:
            self._say_hello(previous)

    def _tell_clients(self) -> None:
        if self.worker is not None:
            control = self.control.name if self.control else None
            self.worker.send({"type": "clients", "control": control, "count": len(self.clients)})

    def _say_hello(self, client: Client) -> None:
        worker = self.worker
        if worker is None or not worker.viewer_port:
            return  # said when it is ready
        hello: dict[str, Any] = {
            **worker.hello,
            "type": "hello",
            "session": self.id,
            "version": __version__,
            "control": client is self.control,
            "run": self.runs,
            "view": f"/view/{self.id}/",
            "watch": self.watch_path if self.shares_watch and client.role == "owner" else None,
        }
        client.outbox.put(to_json(hello))

    def _broadcast(self, text: str) -> None:
        for client in self.clients.values():
            client.outbox.put(text)


def to_json(message: dict[str, Any]) -> str:
    """The JSON text of a message."""
    return msgspec.json.encode(message).decode()
