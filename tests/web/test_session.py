"""A page, its worker and its viewer, from the first request to the last."""

import re
import time

import msgspec
import pytest
from websockets.exceptions import ConnectionClosed

from app import __version__
from tests.web.conftest import Server, StartServer, wait_until
from tests.web.test_view_messages import pack


def test_a_page_gets_its_worker_and_status(server: Server):
    """The page's socket starts a worker, says hello and then passes on status."""
    browser = server.browser()
    page = browser.page()
    assert page.hello["session"] == browser.session
    assert page.hello["version"] == __version__
    assert page.hello["control"] is True
    assert page.hello["view"] == f"/view/{browser.session}/"
    assert page.hello["methods"] == ["direct"]
    page.push(1, right=[0.5, -0.25], device="pointer", yaw=0.2)
    status = page.status_where(lambda s: s["input"])
    assert status["input"]["right"] == [0.5, -0.25]
    assert status["input"]["yaw"] == 0.2
    assert status["input"]["client"] == status["clients"]["control"]
    assert server.health() == {
        "status": "ok",
        "version": __version__,
        "sessions": 1,
        "capacity": 4,
    }


def test_the_viewer_shows_the_workers_scene(server: Server):
    """Scene frames come down unchanged, the camera goes up, on viser's subprotocol."""
    browser = server.browser()
    page = browser.page()
    with browser.viewer() as viewer:
        assert viewer.subprotocol and viewer.subprotocol.startswith("viser-v")
        viewer.send(pack())
        frame = viewer.recv(30)
        assert isinstance(frame, bytes)
        page.status_where(lambda s: s["viewers"] == 1)
        viewer.send(pack(fov=0.5))
        page.status_where(lambda s: s["cameras"] > 0)


def test_commands_are_answered_to_the_page_that_sent_them(server: Server):
    """An ack carries the page's own number; a notice goes to all pages."""
    browser = server.browser()
    page, second = browser.page(), browser.page()
    assert page.command(5, "grasp")["error"] is None
    page.command(6, "method", method="notice")
    assert second.next("notice")["text"] == "the disk is full"
    assert not [m for m in second.seen if m["type"] == "ack"]


def test_a_new_scene_is_said_again_to_every_page(server: Server):
    """The worker's hello is completed for each page; a page that comes later hears the new one."""
    browser = server.browser()
    page, second = browser.page(), browser.page()
    page.send(type="command", id=1, name="new-trial", scene="clutter")
    for tab, control in ((page, True), (second, False)):
        hello = tab.next("hello")
        assert hello["scene"]["name"] == "clutter"
        assert (hello["control"], hello["session"]) == (control, browser.session)
        assert hello["view"] == f"/view/{browser.session}/"
    assert browser.page().hello["scene"]["name"] == "clutter"


def test_ping_is_answered_at_once_and_its_round_trip_reaches_the_worker(server: Server):
    """The web process answers by itself, also while the worker is busy."""
    page = server.browser().page()
    page.send(type="ping", t=123.5, rtt=17.0)
    assert page.next("pong")["t"] == 123.5
    page.status_where(lambda s: s["rtt"] == 17.0)


def test_page_events_reach_the_worker_in_order(server: Server):
    """Blur and hidden stop the robot, so none may be lost."""
    page = server.browser().page()
    for name in ("blur", "hidden", "visible", "focus"):
        page.send(type="event", name=name)
    page.status_where(lambda s: s["events"] == ["blur", "hidden", "visible", "focus"])


def test_a_replayed_or_overtaken_input_is_refused(server: Server):
    """Only a sequence number above the last one counts."""
    page = server.browser().page()
    page.push(5, right=[1, 0])
    page.status_where(lambda s: s["input"])
    page.push(5, right=[0, 1])
    page.push(4, right=[0, 1])
    page.push(6, right=[-1, 0])
    status = page.status_where(lambda s: s["input"]["seq"] == 6)
    assert status["inputs"] == 2


def test_a_second_tab_watches_and_takes_over_when_the_first_is_closed(server: Server):
    """Control belongs to one page; nobody has it for a moment, then the one that watched."""
    browser = server.browser()
    first, second = browser.page(), browser.page()
    assert second.hello["control"] is False
    assert second.hello["session"] == first.hello["session"]
    ack = second.command(1, "grasp")
    assert "only watches" in ack["error"]
    second.push(1, right=[1, 1])
    status = first.status_where(lambda s: s["clients"]["count"] == 2)
    assert status["input"] is None
    first.socket.close()
    second.status_where(lambda s: s["clients"]["control"] is None)
    assert second.next("hello")["control"] is True
    assert second.command(2, "grasp")["error"] is None


def test_a_silent_page_yields_to_a_new_one(server: Server):
    """A half-open connection must not keep its own browser from coming back."""
    browser = server.browser()
    first = browser.page()
    while not browser.page().hello["control"]:  # until the first has been silent for 2.5 s
        time.sleep(0.5)
    assert first.next("hello", control=False)


def test_a_dropped_page_comes_back_to_the_same_worker(server: Server):
    """The worker keeps running; the page that returns has control again."""
    browser = server.browser()
    page = browser.page()
    pid = server.pid_of(browser.session)
    page.push(1, right=[1, 0])
    page.status_where(lambda s: s["input"])
    page.socket.close()
    again = browser.page()
    assert again.hello["control"] is True
    assert server.pid_of(browser.session) == pid
    again.push(1, right=[0, 1])  # a reloaded page counts from one again
    again.status_where(lambda s: s["input"]["right"] == [0, 1])


def test_two_browsers_have_two_sessions(server: Server):
    """Each has its own worker and sees its own input only."""
    one, two = server.browser(), server.browser()
    first, second = one.page(), two.page()
    assert one.session != two.session
    first.push(1, right=[1, 0])
    first.status_where(lambda s: s["input"])
    assert second.next("status")["input"] is None
    assert server.health()["sessions"] == 2


def test_a_read_only_link_watches(server: Server):
    """The link opens the page, the viewer and the status, but controls nothing."""
    owner = server.browser()
    page = owner.page()
    projector = server.browser()
    answer = projector.http.get(page.hello["watch"])
    assert "refresh" in answer.text
    answer = projector.http.get(f"/?watch={owner.session}")
    assert f'content="{owner.session}"' in answer.text
    projector.session = owner.session
    watching = projector.page()
    assert watching.hello["control"] is False
    assert watching.hello["watch"] is None
    assert "only watches" in watching.command(1, "grasp")["error"]
    with projector.viewer() as viewer:
        assert isinstance(viewer.recv(30), bytes)
    page.socket.close()
    watching.status_where(lambda s: s["clients"]["control"] is None)


def test_a_closed_page_ends_its_worker(start_server: StartServer):
    """After the time that a reload may take; the browser's next page starts a new session run."""
    server = start_server(linger_s=0.3)
    browser = server.browser()
    page = browser.page()
    first_run = page.next("status")["session"]
    page.socket.close()
    wait_until(lambda: server.health()["sessions"] == 0)
    again = browser.page()
    assert (first_run, again.next("status")["session"]) == ("1", "2")


def test_participant_n_plus_1_is_asked_to_wait_and_let_in(start_server: StartServer):
    """A friendly page that tries again; it opens once a place is free."""
    server = start_server(capacity=1, linger_s=0.2)
    page = server.browser().page()
    late = server.browser()
    early_tab = server.browser()
    answer = late.http.get("/")
    assert answer.status_code == 503
    assert "The one place is taken" in answer.text
    assert 'http-equiv="refresh"' in answer.text
    for path in re.findall(r'href="(/static/[^"]+)"', answer.text):
        assert late.http.get(path).status_code == 200
    assert server.health()["status"] == "full"
    page.socket.close()
    wait_until(lambda: late.http.get("/").status_code == 200)
    assert late.page().hello["control"] is True
    assert early_tab.http.get("/").status_code == 503


def test_a_page_that_lost_the_race_for_the_last_place_is_told(start_server: StartServer):
    """Its page was served while there was room; its socket says why it cannot start."""
    server = start_server(capacity=1)
    slow, quick = server.browser(), server.browser()
    slow.open()
    quick.page()
    page = slow.dial()
    assert "1 places" in page.next("ended")["reason"]
    with pytest.raises(ConnectionClosed) as caught:
        page.socket.recv(30)
    assert caught.value.rcvd and caught.value.rcvd.code == 4003


def test_status_is_passed_on_word_for_word(server: Server):
    """The web process adds and removes nothing."""
    page = server.browser().page()
    status = page.next("status")
    assert {"input", "clients", "viewers", "session"} <= status.keys()
    assert msgspec.json.encode(status)
