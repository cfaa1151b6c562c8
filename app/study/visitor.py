"""A scripted participant: speaks what the pages speak, over HTTP and the real websockets.

It steers by the hand's and objects' positions, which only a test run tells, and knows nothing of
the method. Used by the dry run and by tests of faults.
"""

import http.client
import json
import math
import threading
import time
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection

from app.study.errors import StudyError

RATE_HZ = 30.0
PATIENCE_S = 180.0
"""How long anything that must happen may take on a busy machine [s]."""
DEVICE_REPORT = {
    "webgl": "yes",
    "input": "pointer",
    "gamepad": "no",
    "width_px": 1280,
    "height_px": 720,
    "pixel_ratio": 1,
    "frame_rate_hz": 60.0,
    "round_trip_ms": 5.0,
    "touch": "no",
    "browser": "simulated",
}
TRY_LATER = 4003
"""Close code of the robot's line where no place is free."""
_FAILED = "the participant could not go on"


class VisitorError(StudyError):
    """Something that must work for a participant did not."""


@dataclass
class Visitor:
    """One participant with a browser of their own.

    Attributes:
        url: The server's address.
        request: The browser's own number for its consent.
        outcomes: Of all trials so far.
        waited: How often no place was free.
    """

    url: str
    request: str
    cookies: dict[str, str] = field(default_factory=dict)
    outcomes: list[str] = field(default_factory=list)
    waited: int = 0
    seen: list[str] = field(default_factory=list)
    """Every JSON text that came to this browser, where `keep` is set."""
    keep: bool = False
    stop: threading.Event = field(default_factory=threading.Event)

    # http

    def call(
        self, method: str, path: str, wish: dict[str, Any] | None = None, **headers: str
    ) -> tuple[int, str]:
        """One request; cookies are kept. Returns status and body."""
        parts = urlsplit(self.url)
        connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=60)
        sent = {"Cookie": self.cookie, "Origin": self.url, **headers}
        body = None
        if wish is not None:
            body = json.dumps(wish)
            sent.setdefault("Content-Type", "application/json")
        try:
            connection.request(method, path, body, sent)
            response = connection.getresponse()
            text = response.read().decode()
            for line in response.headers.get_all("set-cookie") or []:
                self._keep_cookie(line)
            return response.status, text
        finally:
            connection.close()

    def state(self) -> dict[str, Any]:
        """Where this participant is."""
        return self._json(self.call("GET", "/api/study"))["state"]

    def want(self, **wish: Any) -> dict[str, Any]:
        """Ask for something; the whole answer, with its `status`."""
        status, text = self.call("POST", "/api/study", wish)
        return {**self._json((status, text)), "status": status}

    @property
    def cookie(self) -> str:
        """The Cookie header."""
        return "; ".join(f"{name}={value}" for name, value in self.cookies.items())

    def _json(self, answer: tuple[int, str]) -> dict[str, Any]:
        if self.keep:
            self.seen.append(answer[1])
        return json.loads(answer[1])

    def _keep_cookie(self, line: str) -> None:
        name, _, rest = line.partition("=")
        value = rest.partition(";")[0].strip('"')
        if value and "max-age=0" not in line.lower():
            self.cookies[name] = value
        else:
            self.cookies.pop(name, None)

    # the study

    def arrive(self, query: str = "") -> None:
        """Open the link."""
        self.call("GET", f"/{query}")

    def take_part(self, until: str = "done") -> dict[str, Any]:
        """Go through the study up to a step; returns its state.

        Raises:
            VisitorError: If a step cannot be done.
        """
        deadline = time.monotonic() + 3600
        while time.monotonic() < deadline and not self.stop.is_set():
            state = self.state()
            if state["step"] == until and not state.get("saving"):
                return state
            if state["step"] in ("done", "withdrawn") and not state.get("saving"):
                raise VisitorError(f"{_FAILED}: it ended at {state['step']} {state['page']}")
            if state.get("saving"):
                time.sleep(0.5)
            else:
                self.do_step(state)
        raise VisitorError(f"{_FAILED}: it took more than an hour")

    def do_step(self, state: dict[str, Any]) -> None:
        """Do what the step asks for; a trial that ends badly is simply due again."""
        if "trial" in state and state["trial"]["part"] != "free":
            self.do_trial(state["trial"])
            return
        answer = self.submit(state)
        if answer["status"] not in (200, 409):
            raise VisitorError(f"{_FAILED} at {state['step']}: {answer.get('error')}")

    def submit(self, state: dict[str, Any]) -> dict[str, Any]:
        """Answer or leave the page of a step."""
        return self.want(**self.wish(state))

    def wish(self, state: dict[str, Any]) -> dict[str, Any]:
        """What the page of a step sends when it is done."""
        step, at = state["step"], state["at"]
        if step == "consent":
            return {"do": "consent", "request": self.request, "agree": True}
        if step == "device":
            return {"do": "answer", "at": at, "page": "device", "values": DEVICE_REPORT}
        if "form" in state:
            page, values = state["form"]["page"], fill(state["form"])
            return {"do": "answer", "at": at, "page": page, "values": values}
        return {"do": "continue", "at": at, "page": state["leave"]}

    def do_trial(self, due: dict[str, Any]) -> None:
        """One attempt at the trial that is due, up to its outcome."""
        try:
            with self.dial(due["session"]) as socket:
                self._steer(socket)
        except InvalidStatus as error:
            if error.response.status_code != 403:  # a server that was started anew
                raise VisitorError(f"{_FAILED}: the robot's line was refused: {error}") from None
            time.sleep(0.2)
        except ConnectionClosed as error:
            full = error.rcvd is not None and error.rcvd.code == TRY_LATER
            self.waited += full
            time.sleep(1.0 if full else 0.1)
        except OSError:
            time.sleep(0.5)  # the server is being started anew

    def dial(self, session: str) -> ClientConnection:
        """Open the line to the robot."""
        return connect(
            f"{self.url.replace('http', 'ws', 1)}/input/{session}",
            origin=self.url,  # type: ignore[arg-type]
            additional_headers={"Cookie": self.cookie},
            compression=None,
            max_size=None,
            proxy=None,
            close_timeout=1,
        )

    def _steer(self, socket: Connection) -> None:
        """Trial after trial, as long as this worker serves them."""
        pilot = Steering()
        deadline = time.monotonic() + PATIENCE_S
        due = 0
        while time.monotonic() < deadline and not self.stop.is_set():
            text = str(socket.recv(PATIENCE_S))
            if self.keep:
                self.seen.append(text)
            message = json.loads(text)
            if message["type"] == "study" and message.get("event") == "ready":
                due = message["trial"]
            elif message["type"] == "hello":
                state = self.state()
                due = state.get("trial", {}).get("log", 0)
            if message["type"] != "status":
                continue
            trial = message["trial"]
            if trial["outcome"] != "running":
                if trial["number"] == due:
                    self.outcomes.append(trial["outcome"])
                    due, deadline = -1, time.monotonic() + PATIENCE_S
                continue
            if trial["number"] == due:
                for sent in pilot.act(message):
                    socket.send(json.dumps(sent))
        raise VisitorError(f"{_FAILED}: no outcome after {PATIENCE_S:.0f} s")


class Steering:
    """Beside the object first, then straight in; closes the hand where it has settled."""

    def __init__(self) -> None:
        self._sequence = 0
        self._commands = 0
        self._trial = -1
        self._begin(-1)

    def _begin(self, trial: int) -> None:
        self._trial, self._aligned, self._settled = trial, False, 0
        self._asked: set[str] = set()

    def act(self, status: dict[str, Any]) -> list[dict[str, Any]]:
        """What to send after this status."""
        trial = status["trial"]
        if trial["number"] != self._trial:
            self._begin(trial["number"])
        if trial["phase"] == "ready":
            return self._command("start")
        if trial["phase"] != "running":
            return [self._input(0.0, 0.0, 0.0)]
        error = [
            o - h for o, h in zip(status["objects"][trial["target"]], status["hand"], strict=True)
        ]
        dx, dy, dz = error
        if abs(dy) < 0.012 and abs(dz) < 0.02:
            self._aligned = True
        if abs(dy) > 0.03 and dx > 0.05:
            self._aligned = False
        if self._aligned and math.hypot(dx, dy) < 0.012 and abs(dz) < 0.03:
            self._settled += 1
            rest = [self._input(0.0, 0.0, 0.0)]
            return rest + (self._command("grasp") if self._settled > 4 else [])
        self._settled = 0
        forward = dx if self._aligned else min(0.0, dx - 0.16)
        return [self._input(*(max(-1.0, min(1.0, 9.0 * e)) for e in (forward, dy, dz)))]

    def _command(self, name: str) -> list[dict[str, Any]]:
        if name in self._asked:
            return []
        self._asked.add(name)
        self._commands += 1
        return [{"type": "command", "id": self._commands, "name": name}]

    def _input(self, x: float, y: float, z: float) -> dict[str, Any]:
        self._sequence += 1
        return {
            "type": "input",
            "seq": self._sequence,
            "t": time.monotonic() * 1000,
            "left": [0.0, z],
            "right": [-y, x],
            "device": "pointer",
            "yaw": 0.0,
            "dead_zone": 0.1,
        }


def fill(form: dict[str, Any]) -> dict[str, Any]:
    """Valid answers to every question of a form."""
    values: dict[str, Any] = {}
    for item in (item for section in form["sections"] for item in section["items"]):
        if item["kind"] in ("likert", "preference"):
            values[item["key"]] = item["points"] - 1
        elif item["kind"] == "choice":
            values[item["key"]] = item["options"][0]["value"]
        elif item["kind"] == "number":
            values[item["key"]] = item["low"]
        elif item["required"]:
            values[item["key"]] = "simulated"
    return values
