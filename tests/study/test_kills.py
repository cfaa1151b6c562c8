"""SIGKILL of the server at every step of the protocol in turn, with drafts and trials under way."""

import csv
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from app.study.load import HERE
from app.study.visitor import Steering, Visitor, fill
from tests.study.server import StudyServer

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]
SHORTER = {"each_object: true": "each_object: false", "extra: 6": "extra: 1"}
SHORTER |= {"scene: default": "scene: pair.yaml"}
SCENE = """
name: pair
title: Block and glass
places: [{name: left, x_m: 0.82, y_m: 0.22}, {name: right, x_m: 0.82, y_m: -0.22}]
start_degrees: [0, 49.2, 0, 140.2, 0, -99.4, 0]
objects:
  - {name: block, kind: block, colour: vermilion, mass_kg: 0.25, size_m: [0.05, 0.06, 0.10]}
  - {name: glass, kind: glass, colour: sky, mass_kg: 0.20, radius_m: 0.032, height_m: 0.11}
"""
STEPS = ["consent", "background", "device", "instructions", "training", "trial", "switch"]
STEPS += ["survey", "debrief", "done"]
State = dict[str, Any]
Until = Literal["running", "outcome"]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[StudyServer]:
    """A study with every kind of step, free and further practice included, in a few trials."""
    text = (HERE / "paper.yaml").read_text(encoding="utf-8")
    for old, new in SHORTER.items():
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "pair.yaml").write_text(SCENE, encoding="utf-8")
    path = tmp_path / "short.yaml"
    path.write_text(text, encoding="utf-8")
    running = StudyServer(tmp_path, study=str(path))
    try:
        yield running.start()
    finally:
        running.stop()


def where(state: dict[str, Any]) -> list[Any]:
    """What has to be the same after the server has come back."""
    trial = state.get("trial", {})
    place = [state.get(key) for key in ("participant", "step", "page", "at", "labels", "extra")]
    codes = [state.get("completion"), state.get("withdrawal")]
    return [*place, *codes, trial.get("part"), trial.get("label"), trial.get("target")]


def drive(person: Visitor, socket: Any, until: Until) -> int:
    """Steer the trial that is due up to here; returns the number of its log."""
    pilot, due = Steering(), 0
    while True:
        message = json.loads(socket.recv(120))
        if message["type"] == "study" and message.get("event") == "ready":
            due = message["trial"]
        elif message["type"] == "hello":
            due = person.state().get("trial", {}).get("log", 0)
        elif message["type"] == "status" and message["trial"]["number"] == due:
            trial = message["trial"]
            if trial["outcome"] != "running" or trial["phase"] == until:
                return due
            for sent in pilot.act(message):
                socket.send(json.dumps(sent))


def reach(person: Visitor, state: State, until: Until) -> tuple[ClientConnection, int]:
    """The open line to a robot in this phase of the trial that is due, and its log's number."""
    while True:
        socket = person.dial(state["trial"]["session"])
        try:
            return socket, drive(person, socket, until)
        except ConnectionClosed:
            time.sleep(0.1)  # the robot of the trial before was just being put away


def kill_in_trial(server: StudyServer, person: Visitor, state: State, until: Until) -> int:
    """The server dies while the arm moves, or in the moment the outcome is known."""
    socket, log = reach(person, state, until)
    server.kill()
    socket.close()
    server.start()
    return log


def finish_trial(person: Visitor, at: int) -> None:
    """Do the trial of this step until it has come out well."""
    while (now := person.state())["at"] == at and "trial" in now:
        socket, log = reach(person, now, "outcome")
        while person.state().get("trial", {}).get("log") == log:
            time.sleep(0.1)
        socket.close()


def draft_of(person: Visitor, state: State) -> dict[str, Any]:
    """Answer the first two questions of a page."""
    values = dict(list(fill(state["form"]).items())[:2])
    page = state["form"]["page"]
    assert person.want(do="draft", at=state["at"], page=page, values=values)["status"] == 200
    return values


def test_a_server_killed_at_every_step_loses_and_doubles_nothing(server: StudyServer):
    """They go on where they were; no answer is asked again, no trial lost or counted twice."""
    person = Visitor(server.url, "browser-00000000kill")
    person.arrive("?PROLIFIC_PID=killed")
    seen: list[str] = []
    cut: list[int] = []
    last: dict[str, Any] = {}
    while (before := person.state()).get("completion") is None or seen[-1] != "done":
        at, step, trial = before["at"], before["step"], before.get("trial")
        seen.append(step)
        if trial and step == "trial" and trial["number"] == 2:
            kill_in_trial(server, person, before, "outcome")
            assert person.state()["at"] in (at, at + 1)
            finish_trial(person, at)
            continue
        draft = draft_of(person, before) if "form" in before else {}
        if trial:
            cut.append(kill_in_trial(server, person, before, "running"))
        else:
            server.kill()
            server.start()
        after = person.state()
        assert where(after) == where(before)
        assert not draft or after["form"]["values"] == draft
        if trial:
            assert after["trial"]["attempt"] == trial["attempt"] + 1
            assert after["trial"]["again"] == "interrupted"
        if last:  # an answer got lost with the server: the page sends the same once more
            assert where(person.want(**last)["state"]) == where(before)
        last = {}
        if trial and trial["part"] != "free":
            finish_trial(person, at)
        elif before.get("extra", {}).get("left"):
            assert person.want(do="extra", at=at, place=0)["status"] == 200
        elif step != "done":
            last = person.wish(after)
            assert person.want(**last)["status"] == 200
    assert list(dict.fromkeys(seen)) == STEPS
    check_files(server.sessions / "paper" / "data", before["participant"], cut)


def check_files(folder: Path, participant: str, cut: list[int]) -> None:
    """Every log has its row, cut ones are interrupted, each object counts once a method."""
    rows = table(folder, "trials")
    assert {r["participant_id"] for r in rows} == {participant}
    outcomes = {int(r["trial"]): r["outcome"] for r in rows}
    assert len(outcomes) == len(rows)
    assert {outcomes.get(number, "interrupted") for number in cut} == {"interrupted"}
    counted = sorted((r["method"], r["object"]) for r in rows if r["counted"] == "true")
    names = ("block", "glass")
    assert counted == [(method, name) for method in ("blend", "policy") for name in names]
    raw = folder / "raw" / f"subject-{participant}" / "session-1"
    logs = {int(path.name[6:9]) for path in raw.glob("trial-*.mcap")}
    free = set(cut[:1])  # free practice has a log, and no row
    assert logs == set(outcomes) | free
    answers = [(r["shown_as"], r["item"]) for r in table(folder, "survey")]
    assert len(answers) == len(set(answers)) == 9
    assert [r["status"] for r in table(folder, "participants")] == ["completed"]


def table(folder: Path, what: str) -> list[dict[str, str]]:
    """A table of the study."""
    path = folder / f"study-paper_description-{what}_data.csv"
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))
