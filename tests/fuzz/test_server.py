"""A running server under fire: every request is answered, and the next visitor is let in."""

import json
import string
import subprocess
from pathlib import Path

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed

import app
from app.web.messages import MessageError, parse_message
from app.web.vendor import npm_command
from tests.fuzz.budget import LARGE, SMALL, budget
from tests.web.conftest import Browser, Server, start_server

__all__ = ["start_server"]
pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

PATHS = ["/", "/api/health", "/watch/", "/view/", "/static/", "/input/", "/..", "/%2e%2e/", "//"]
SAFE = string.ascii_letters + string.digits + "%./?&=#;:@!$'()*+,-_~[]|<>\\\"{}^` "
QUERY = Path(app.__file__).parent.parent / "static" / "query.js"


@pytest.fixture
def server(start_server) -> Server:  # noqa: ANN001
    """A server with stand-in workers; one for all examples."""
    return start_server()


@pytest.fixture
def browser(server: Server) -> Browser:
    """One browser for all examples, so that they are one session."""
    browser = server.browser()
    browser.open()
    return browser


@given(st.data())
@budget(2 * SMALL)
def test_any_path_and_query_is_answered(server: Server, data: st.DataObject) -> None:
    """By a page or a refusal; never by a fault of ours."""
    path = data.draw(st.sampled_from(PATHS)) + data.draw(st.text(SAFE, max_size=40))
    query = data.draw(st.text(SAFE, max_size=60))
    cookie = data.draw(st.text(string.ascii_letters + string.digits + "=.;-_ ", max_size=40))
    try:
        answer = httpx.get(
            httpx.URL(server.url, raw_path=f"{path}?{query}".encode("ascii", "ignore")),
            headers={"cookie": cookie} if cookie.strip() else {},
            trust_env=False,
        )
    except (httpx.InvalidURL, httpx.LocalProtocolError, httpx.RemoteProtocolError):
        return
    assert answer.status_code in (200, 307, 400, 403, 404, 405, 421, 503), (path, query)
    assert server.health()["status"] in ("ok", "full")


@given(st.lists(st.binary(max_size=200) | st.text(max_size=200), min_size=1, max_size=20))
@budget(SMALL // 3)
def test_any_frames_leave_the_server_serving(browser: Browser, frames: list[bytes | str]) -> None:
    """On both sockets of a session; a bystander is answered afterwards."""
    page = browser.page()
    with browser.viewer() as viewer:
        for socket in (page.socket, viewer):
            try:
                for frame in frames:
                    socket.send(frame)
            except ConnectionClosed:
                pass
    page.socket.close()
    again = browser.page()
    again.push(10**9, right=[1, 0])
    assert again.next("status")
    again.socket.close()


def test_any_query_of_the_page_is_a_trial_or_refused(tmp_path: Path) -> None:
    """`?method=…&seed=…` as the page reads it, then as the server judges it."""
    queries: list[str] = []
    names = st.sampled_from(["method", "target", "seed", "scene", "x"])

    @given(st.lists(st.tuples(names, st.text(max_size=20)), max_size=6))
    @budget(LARGE // 6)
    def collect(pairs: list[tuple[str, str]]) -> None:
        queries.append("?" + "&".join(f"{name}={value}" for name, value in pairs))

    collect()
    (tmp_path / "query.mjs").write_text(QUERY.read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "run.mjs").write_text(
        "import {trialFromQuery} from './query.mjs'; import {readFileSync} from 'fs';"
        "const all = JSON.parse(readFileSync('queries.json', 'utf8'));"
        "console.log(JSON.stringify(all.map((q) => trialFromQuery(q))));"
    )
    (tmp_path / "queries.json").write_text(json.dumps(queries), encoding="utf-8")
    done = subprocess.run(
        [npm_command()[0], "run.mjs"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    trials = json.loads(done.stdout)
    assert len(trials) == len(queries) and any(trials)
    for fields in trials:
        if fields is None:
            continue
        try:
            parse_message(json.dumps({"type": "command", "id": 1, "name": "new-trial", **fields}))
        except MessageError as error:
            assert error.command_id == 1
