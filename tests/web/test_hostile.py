"""Who is not our own page gets nothing, and is told why."""

import json
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from app.web.viewer_page import subprotocol
from tests.web.conftest import Browser, Page, Server, StartServer
from tests.web.test_view_messages import pack

VISER = [Subprotocol(subprotocol())]


def refused(browser: Browser, path: str, **options: Any) -> tuple[int, str]:
    """Status and text with which a websocket handshake is refused."""
    with pytest.raises(InvalidStatus) as caught:
        browser.socket(path, **options)
    response = caught.value.response
    return response.status_code, bytes(response.body or b"").decode()


def paths(browser: Browser) -> list[tuple[str, dict[str, Any]]]:
    """Both sockets of the browser's session, and how they are asked for."""
    view = (f"/view/{browser.session}", {"subprotocols": VISER})
    return [(f"/input/{browser.session}", {}), view]


def test_a_wrong_origin_is_refused(server: Server):
    """Another site, another scheme, another port, none at all: 403, and the words name it."""
    browser = server.browser()
    browser.page()
    bad = ["https://evil.example", server.url.replace("http", "https"), server.url + "1", None]
    for path, options in paths(browser):
        for origin in bad:
            status, text = refused(browser, path, **options, origin=origin)
            assert status == 403
            assert repr(origin) in text and server.url in text


def test_a_wrong_or_missing_cookie_is_refused(server: Server):
    """The id in the path opens nothing."""
    browser, thief = server.browser(), server.browser()
    browser.page()
    thief.open()
    for path, options in paths(browser):
        for cookie in ({}, {"Cookie": thief.cookie}, {"Cookie": browser.cookie[:-1] + "!"}):
            status, text = refused(thief, path, **options, additional_headers=cookie)
            assert status == 403
            assert browser.session in text and "cookie" in text
    assert refused(thief, "/input/nobody")[0] == 403
    assert thief.http.get(f"/view/{browser.session}/").status_code == 403
    assert thief.http.get(f"/?watch={browser.session}").status_code == 403
    assert thief.http.get(f"/watch/{browser.session}.guess").status_code == 404


def test_another_hosts_name_is_refused(server: Server):
    """A site that binds its own name to 127.0.0.1 is not answered."""
    answer = httpx.get(server.url, headers={"Host": "evil.example:80"}, trust_env=False)
    assert answer.status_code == 421
    assert "evil.example" in answer.text and "127.0.0.1" in answer.text
    browser = server.browser()
    browser.page()
    headers = {"Cookie": browser.cookie, "Host": "evil.example"}
    with pytest.raises(InvalidStatus) as caught:
        connect(
            server.url.replace("http", "ws") + f"/input/{browser.session}",
            origin="http://evil.example",  # type: ignore[arg-type]
            additional_headers=headers,
            proxy=None,
        )
    assert caught.value.response.status_code in (400, 403, 421)


def test_the_cookie_is_out_of_reach_of_scripts_and_other_sites(server: Server):
    """HttpOnly, SameSite=Strict, and its value is in neither the page nor any path."""
    browser = server.browser()
    answer = browser.http.get("/")
    header = answer.headers["set-cookie"]
    assert "HttpOnly" in header and "samesite=strict" in header.lower()
    secret = header.split(".", 1)[1].split(";")[0]
    assert len(secret) >= 40 and secret not in answer.text


@pytest.mark.parametrize("path", ["/", "/api/health", "/static/icons.svg", "/nothing", "/watch/x"])
def test_every_answer_carries_the_common_headers(server: Server, path: str):
    """No referrer, no sniffing, nothing kept that holds a session."""
    headers = server.browser().http.get(path).headers
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["cache-control"] in ("no-store", "no-cache")
    assert "server" not in headers


def test_pages_allow_no_foreign_and_no_inline_script(server: Server):
    """The page's policy names this server only; viser's frame may not evaluate text."""
    browser = server.browser()
    browser.open()
    page = browser.http.get("/").headers["content-security-policy"]
    assert "default-src 'none'" in page and "script-src 'self';" in page
    assert "frame-ancestors 'none'" in page
    frame = browser.http.get(f"/view/{browser.session}/").headers["content-security-policy"]
    assert "'unsafe-eval'" not in frame and "frame-ancestors 'self'" in frame
    for policy in (page, frame):
        assert "http:" not in policy and "https:" not in policy and "*" not in policy


def test_a_text_frame_closes_the_view_socket_and_not_the_workers(server: Server):
    """Viser would die of it; the other viewers of the session do not notice."""
    browser = server.browser()
    page = browser.page()
    with browser.viewer() as bad, browser.viewer() as good:
        bad.send("hello")
        with pytest.raises(ConnectionClosed) as caught:
            while True:
                bad.recv(30)
        assert caught.value.rcvd and caught.value.rcvd.code == 1003
        good.send(pack())
        page.status_where(lambda s: s["viewers"] == 1)


def test_a_share_request_never_reaches_viser(server: Server):
    """Sent to viser itself it would open a tunnel; through the proxy it is dropped."""
    browser = server.browser()
    page = browser.page()
    share = b"\x81\xa4type\xafShareUrlRequest"
    with browser.viewer() as viewer:
        for _ in range(3):
            viewer.send(pack(type="ShareUrlRequest"))
            viewer.send(share)
        viewer.send(pack())
        viewer.send(pack(fov=0.4))
        status = page.status_where(lambda s: s["viewers"] == 1 and s["cameras"] > 0)
        assert status["shared"] == 0
    session = server.registry.by_id(browser.session)
    assert session and session.worker
    direct = f"ws://127.0.0.1:{session.worker.viewer_port}"
    with connect(direct, subprotocols=VISER, max_size=None, proxy=None) as viewer:
        viewer.send(share)
        page.status_where(lambda s: s["shared"] == 1)


def test_persistent_forbidden_frames_close_the_view_socket(server: Server):
    """Who goes on asking is not our page."""
    browser = server.browser()
    browser.page()
    with browser.viewer() as viewer:
        with pytest.raises(ConnectionClosed):
            for _ in range(500):
                viewer.send(pack(type="ShareUrlRequest"))
            while True:
                viewer.recv(30)
        assert viewer.close_code in (1008, 1006)


def test_another_viser_version_is_refused(server: Server):
    """Also a handshake without any subprotocol."""
    browser = server.browser()
    browser.page()
    path = f"/view/{browser.session}"
    wrong = [Subprotocol("viser-v0.0.1")]
    assert refused(browser, path, subprotocols=wrong) == (
        400,
        f"subprotocols are ['viser-v0.0.1']; valid: {subprotocol()}\n",
    )
    assert refused(browser, path)[0] == 400


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "invalid JSON"),
        ('{"type":"input","seq":1,"t":1,"left":[7,0],"right":[0,0]}', "left.0 is 7"),
        ('{"type":"input","seq":1,"t":NaN,"left":[0,0],"right":[0,0]}', "finite"),
        (json.dumps({"type": "event", "name": "x" * 5000}), "at most 4096"),
        (b"\x00\x01", "binary frame"),
    ],
)
def test_a_malformed_message_is_answered_once_and_has_no_effect(
    server: Server, text: str | bytes, words: str, caplog: pytest.LogCaptureFixture
):
    """One answer that names it, one log line, and the page goes on."""
    page = server.browser().page()
    page.socket.send(text)
    assert words in page.next("error")["text"]
    assert len([r for r in caplog.records if words in r.getMessage()]) <= 1
    page.push(1, right=[1, 0])
    status = page.status_where(lambda s: s["input"])
    assert (status["inputs"], status["input"]["right"]) == (1, [1, 0])
    assert not [m for m in page.seen if m["type"] == "error"][1:]


def test_a_refused_command_is_answered_by_its_number(server: Server):
    """The page waits for that number."""
    page = server.browser().page()
    assert "preset is missing" in page.command(3, "camera")["error"]
    assert "'dance'" in page.command(4, "dance")["error"]


def test_persistent_nonsense_closes_the_socket_and_no_other(server: Server):
    """After some forty messages; the log holds a handful of lines, not forty."""
    one, two = server.browser(), server.browser()
    page, other = one.page(), two.page()
    with pytest.raises(ConnectionClosed):
        for _ in range(200):
            page.socket.send("nonsense")
        while True:
            page.socket.recv(30)
    assert page.socket.close_code in (1008, 1006)
    assert other.command(1, "grasp")["error"] is None


def test_an_enormous_frame_closes_its_socket_unread(server: Server):
    """Beyond 64 KiB nothing is taken in at all."""
    browser = server.browser()
    page = browser.page()
    with pytest.raises(ConnectionClosed):
        page.socket.send("x" * 100_000)
        while True:
            page.socket.recv(30)
    assert page.socket.close_code in (1009, 1006)
    assert isinstance(browser.page(), Page)


def test_a_link_from_another_site_keeps_the_session(server: Server):
    """Strict cookies do not travel along; the server asks once more from its own page."""
    browser = server.browser()
    answer = browser.http.get("/?seed=1&x=<", headers={"Sec-Fetch-Site": "cross-site"})
    assert "set-cookie" not in answer.headers
    assert 'content="0;url=/?seed=1&amp;x=%3C"' in answer.text


def test_behind_a_tls_proxy_only_the_public_origin_counts(start_server: StartServer):
    """The cookie is bound to encryption; the proxy may or may not pass on the host."""
    server = start_server(public_origin="https://lab.example.org", host="127.0.0.1")
    http = httpx.Client(base_url=server.url, trust_env=False, headers={"Host": "lab.example.org"})
    with http:
        answer = http.get("/")
        header = answer.headers["set-cookie"]
        assert header.startswith("__Host-hindsight-session=") and "Secure" in header
        session = answer.text.split('hindsight-session" content="')[1].split('"')[0]
    browser = server.browser()
    cookie = {"Cookie": header.split(";")[0]}
    path = f"/input/{session}"
    assert refused(browser, path, additional_headers=cookie, origin=server.url)[0] == 403
    origin = "https://lab.example.org"
    page = Page(browser.socket(path, additional_headers=cookie, origin=origin))
    assert page.next("hello")["session"] == session
