"""The server as browsers meet it: whole participations, faults, intruders, the desk."""

import csv
import io
import json
import re
import threading
import time
import urllib.request
import zipfile
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus

from app.study.visitor import Visitor
from tests.study.builders import BACKGROUND
from tests.study.conftest import PASSWORD
from tests.study.server import StudyServer

pytestmark = pytest.mark.timeout(600)


def visitor(server: StudyServer, name: str, **options: Any) -> Visitor:
    """Somebody who has followed the link."""
    person = Visitor(server.url, f"browser-{name:0>12}", **options)
    person.arrive("?fast=1&PROLIFIC_PID=person-" + name)
    return person


def table(server: StudyServer, what: str) -> list[dict[str, str]]:
    """A table of the study."""
    path = server.sessions / "paper" / "data" / f"study-paper_description-{what}_data.csv"
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_whole_participations_in_both_orders_never_name_a_method(server: StudyServer):
    """Two side by side, from link to code; tables right to the row; blind to the last byte."""
    people = [visitor(server, name, keep=True) for name in ("a", "b")]
    ends: list[dict[str, Any]] = []
    threads = [threading.Thread(target=lambda p=p: ends.append(p.take_part())) for p in people]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(ends) == 2 and all(end["completion"] for end in ends)
    rows = table(server, "participants")
    ids = [end["participant"] for end in ends]
    both = [row for row in rows if row["participant_id"] in ids]
    assert [row["status"] for row in both] == ["completed", "completed"]
    assert {row["order"] for row in both} == {"blend>policy", "policy>blend"}
    counted = [r for r in table(server, "trials") if r["counted"] == "true"]
    for who in ids:
        mine = [r for r in counted if r["participant_id"] == who]
        assert sorted((r["method"], r["object"]) for r in mine) == [
            (m, o) for m in ("blend", "policy") for o in ("block", "canteen", "glass")
        ]
        objects = [r["object"] for r in mine]
        assert objects[:3] == objects[3:]
        for row in mine:
            assert (server.sessions / "paper" / row["file"]).is_file()
            assert float(row["time_s"]) > 0.5 and float(row["input_s"]) > 0.1
    raw = server.sessions / "paper" / "data" / "raw"
    answers = [r for r in table(server, "survey") if r["participant_id"] in ids]
    assert len(answers) == 2 * 9
    said = "\n".join(text for person in people for text in person.seen)
    assert len(said) > 100_000
    assert not re.search(r"\b(blend|policy|yielding|direct_teleop)\b", said)
    # What a participant's browser loads, but viser's client, which is the same for everybody.
    static = Path(__file__).parents[2] / "static"
    page = people[0].call("GET", "/")[1]
    names = set(re.findall(r'/static/([\w/.-]+\.(?:js|css))"', page))
    seen: set[str] = set()
    while names - seen:
        name = (names - seen).pop()
        seen.add(name)
        text = people[0].call("GET", f"/static/{name}")[1]
        assert not re.search(r"\b(blend|policy)\b", text, re.IGNORECASE), name
        folder = (static / name).parent
        for found in re.findall(r'from "(\.[\w/.-]+)"', text):
            names.add((folder / found).resolve().relative_to(static).as_posix())
    assert len(seen) > 15
    # Later one of them has all of it deleted, by the code and from another browser.
    code = next(end["withdrawal"] for end in ends if end["participant"] == ids[0])
    stranger = Visitor(server.url, "browser-00000000stranger")
    assert stranger.want(do="erase", code=code)["erased"]
    assert not (raw / f"subject-{ids[0]}").exists() and (raw / f"subject-{ids[1]}").exists()
    assert ids[0] not in {r["participant_id"] for r in table(server, "participants")}


def _started(person: Visitor, socket: Any) -> int:
    """Wait for the trial, give the start signal; the log's number, while the arm is free."""
    due = 0
    while True:
        message = json.loads(socket.recv(120))
        if message["type"] == "study" and message.get("event") == "ready":
            due = message["trial"]
            socket.send(json.dumps({"type": "command", "id": 1, "name": "start"}))
        elif message["type"] == "status" and due == message["trial"]["number"]:
            if message["trial"]["phase"] == "running":
                return due


def test_leaving_in_mid_trial_repeats_it_and_two_tabs_share_one_control(server: StudyServer):
    """The second tab only watches, a dropped line interrupts, the live commands do not exist."""
    person = visitor(server, "tabs")
    while (state := person.state())["step"] != "training":
        person.do_step(state)
    session = state["trial"]["session"]
    with person.dial(session) as socket:
        _started(person, socket)
        with person.dial(session) as second:
            hello = _next(second, "hello")
            assert hello["control"] is False and hello.get("watch") is None
            assert "methods" not in hello and "settings" not in hello
            second.send(json.dumps({"type": "command", "id": 5, "name": "grasp"}))
            assert "only watches" in _next(second, "ack")["error"]
        for number, command in enumerate(
            (
                {"name": "new-trial"},
                {"name": "method", "method": "direct"},
                {"name": "assist", "enabled": False},
                {"name": "settings", "changes": {"gain": 2.0}},
                {"name": "layers", "changes": {"slice": True}},
                {"name": "camera", "preset": "top"},
            ),
            start=10,
        ):
            socket.send(json.dumps({"type": "command", "id": number, **command}))
            error = _next(socket, "ack")["error"]
            assert error and "valid: start, grasp" in error
    deadline = time.monotonic() + 60
    while (now := person.state())["trial"]["again"] != "interrupted":
        assert time.monotonic() < deadline
        time.sleep(0.1)
    assert now["at"] == state["at"]


def _next(socket: Any, kind: str) -> dict[str, Any]:
    while (message := json.loads(socket.recv(60)))["type"] != kind:
        pass
    return message


def test_doubled_skipped_replayed_and_foreign_requests(server: StudyServer):
    """Each is answered with the state, changes nothing, and shows nobody else's data."""
    person = visitor(server, "double")
    first = person.want(do="consent", request=person.request, agree=True)
    own = first["state"]["participant"]
    twin = Visitor(server.url, person.request)
    second = twin.want(do="consent", request=person.request, agree=True)
    assert second["state"]["participant"] == own
    person.cookies = dict(twin.cookies)
    answer = {"do": "answer", "at": 1, "page": "background", "values": BACKGROUND}
    assert person.want(**{**answer, "at": 5})["status"] == 409
    assert person.want(**{**answer, "page": "device"})["status"] == 409
    bad = person.want(**{**answer, "values": {**BACKGROUND, "gender": "x"}})
    assert bad["status"] == 422 and set(bad["items"]) == {"gender"}
    assert person.want(**answer)["state"]["step"] == "device"
    again = person.want(**{**answer, "values": {**BACKGROUND, "gender": "male"}})
    assert again["status"] == 200 and again["state"]["step"] == "device"
    assert person.want(do="continue", at=2, page="device")["status"] == 409
    for wish in ({"do": "fly"}, {"do": "continue", "at": -1, "page": "x"}, {"do": "skip"}, {}):
        assert person.want(**wish)["status"] == 409
    # Without the cookie, with another's name in it, from another site.
    stranger = Visitor(server.url, "browser-00000000stranger")
    assert stranger.want(**answer)["status"] == 403
    name, value = next((n, v) for n, v in person.cookies.items() if "study" in n)
    stranger.cookies = {name: f"{own}." + "x" * 43}
    assert stranger.state()["step"] == "consent"
    status, _ = person.call("POST", "/api/study", {"do": "withdraw"}, Origin="http://evil.example")
    assert status == 403
    session = next(v for n, v in person.cookies.items() if "session" in n).split(".")[0]
    with pytest.raises(InvalidStatus), stranger.dial(session):
        pass
    thief = visitor(server, "double")
    thief.request = "browser-00000000another"
    assert thief.want(do="consent", request=thief.request, agree=True)["status"] == 409
    assert person.state()["step"] == "device" and value
    log = server.log()
    assert "refused" in log and "PROLIFIC" not in log and "person-double" not in log


def test_screening_and_withdrawal(server: StudyServer):
    """Ruled out kindly; one click deletes everything, in mid-trial as well."""
    excluded = visitor(server, "x")
    excluded.do_step(excluded.state())
    values = {**BACKGROUND, "prior_exposure": "yes"}
    ended = excluded.want(do="answer", at=1, page="background", values=values)["state"]
    assert (ended["step"], ended["page"]) == ("withdrawn", "excluded")
    person = visitor(server, "y")
    while (state := person.state())["step"] != "training":
        person.do_step(state)
    own = state["participant"]
    raw = server.sessions / "paper" / "data" / "raw"
    with person.dial(state["trial"]["session"]) as socket:
        _started(person, socket)
        assert (raw / f"subject-{own}").exists()
        gone = person.want(do="withdraw")
    assert gone["state"]["step"] == "withdrawn" and len(gone["state"]["erased"]) >= 4
    assert person.state()["step"] == "withdrawn"
    assert not (raw / f"subject-{own}").exists()
    assert not list((server.sessions / "private" / "paper").glob(f"{own}*"))
    assert own not in {r["participant_id"] for r in table(server, "participants")}
    assert person.want(do="erase", code="AAAA-BBBB-CCCC")["status"] == 422


def test_the_desk(server: StudyServer):
    """Password, bounded guesses, audit; pause, note, skip, end; a download without identities."""
    desk = Visitor(server.url, "desk")
    post = lambda wish, **h: desk.call("POST", "/api/desk", wish, **h)  # noqa: E731
    assert desk.call("GET", "/api/desk")[0] == 401
    assert desk.call("GET", "/desk/download")[0] == 403
    assert post({"password": "wrong"})[0] == 401
    assert post({"do": "pause", "on": True})[0] == 422
    assert post({"password": PASSWORD}, Origin="http://evil.example")[0] == 403
    assert post({"password": PASSWORD})[0] == 200
    person = visitor(server, "desk")
    assert post({"do": "pause", "on": True})[0] == 200
    assert person.want(do="consent", request=person.request, agree=True)["status"] == 409
    post({"do": "pause"})
    while (state := person.state())["step"] != "training":
        person.do_step(state)
    own = state["participant"]
    assert post({"do": "note", "participant": own, "text": "has a cold"})[0] == 200
    shown = json.loads(post({"do": "skip", "participant": own})[1])
    row = next(row for row in shown["people"] if row["id"] == own)
    assert row["at"][0] == state["at"] + 1 and row["notes"] == 1
    assert not re.search(r"\b(blend|policy)\b", json.dumps(shown))
    link = json.loads(post({"do": "link", "participant": own})[1])["link"]
    assert person.state()["step"] == "consent"
    other = Visitor(server.url, "browser-00000000other")
    other.arrive(link.removeprefix("/"))
    assert other.state()["participant"] == own
    assert desk.call("GET", f"/desk/watch/{own}")[0] == 200
    session = other.state()["trial"]["session"]
    with other.dial(session) as socket:
        _started(other, socket)
        with desk.dial(session) as looker:
            hello = _next(looker, "hello")
            assert hello["control"] is False and "methods" not in hello
            looker.send(json.dumps({"type": "command", "id": 1, "name": "grasp"}))
            assert "only watches" in _next(looker, "ack")["error"]
    # The line above was dropped just now: the trial may be ending already.
    assert post({"do": "end", "participant": own})[0] == 200
    assert other.state()["page"] == "excluded"
    request = urllib.request.Request(f"{server.url}/desk/download", headers={"Cookie": desk.cookie})
    with urllib.request.urlopen(request, timeout=120) as answer:
        archive = zipfile.ZipFile(io.BytesIO(answer.read()))
    held = b"".join(archive.read(name) for name in archive.namelist())
    assert any(
        name.endswith(f"subject-{own}/session-1/events.jsonl") for name in archive.namelist()
    )
    assert b"has a cold" not in held and b"person-desk" not in held
    private = server.sessions / "private" / "paper"
    audit = (private / "audit.jsonl").read_text()
    for action in (
        "login failed",
        "login",
        "pause",
        "note",
        "skip",
        "link",
        "watch",
        "download",
        "end",
    ):
        assert f'"action":"{action}"' in audit
    assert "has a cold" in (private / f"{own}.notes.jsonl").read_text() and "cold" not in audit
    guesser = Visitor(server.url, "guesser")
    tries = [guesser.call("POST", "/api/desk", {"password": f"no {i}"})[0] for i in range(6)]
    assert 429 in tries
