"""The client of viser in a real browser, in our frame: what the injected script and style do."""

import os
import re
import signal
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser as Chromium
from playwright.sync_api import Frame, Page
from starlette.responses import HTMLResponse
from starlette.routing import Route

from tests.browser import chromium
from tests.web.conftest import Server, wait_until

pytestmark = pytest.mark.browser

OUTER = """<!doctype html><html data-theme="light"><title>outer</title>
<iframe style="width:400px;height:300px" src="/view/{id}/?hideViserLogo&antialias=0&shadows=0">
</iframe></html>"""
DIAL = """(id) => {
    globalThis.line = new WebSocket(`/input/${id}`);
    line.onmessage = ({ data }) => { globalThis.last = JSON.parse(data); };
}"""
DRAWN = "() => globalThis.__viserMutable?.nodeRefFromName?.['/hindsight/box'] !== undefined"


@pytest.fixture(scope="module")
def browser() -> Iterator[Chromium]:
    """One Chromium for this file."""
    with chromium() as running:
        yield running


@pytest.fixture
def outer(server: Server, browser: Chromium) -> Iterator[Page]:
    """A page of the server's origin around the viewer's frame, with a worker behind it."""
    context = browser.new_context()
    page = context.new_page()
    requests: list[str] = []
    page.on("request", lambda request: requests.append(request.url))
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    context.route("**/static/*.js", lambda route: route.abort())  # the live page is not the topic
    page.goto(server.url)
    session = page.get_attribute('meta[name="hindsight-session"]', "content")
    # Served for real: Chromium lets a made-up answer open no socket to this machine.
    html = HTMLResponse(OUTER.format(id=session))
    server.app.router.routes.append(Route("/outer", html))
    page.goto(server.url + "/outer")
    page.evaluate(DIAL, session)
    wait_for(viewer_frame(page), DRAWN)
    yield page
    assert not errors
    foreign = [url for url in requests if not re.match(rf"{server.url}|data:|blob:", url)]
    assert not foreign
    context.close()


def wait_for(frame: Frame, expression: str) -> None:
    """Wait until an expression holds; asked from outside, because the frame may not evaluate."""
    wait_until(lambda: frame.evaluate(expression))


def viewer_frame(page: Page) -> Frame:
    """The viewer's frame."""
    return next(frame for frame in page.frames if "/view/" in frame.url)


def test_the_scene_arrives_and_only_the_canvas_is_seen(outer: Page):
    """Under the frame's policy viser unpacks, connects and draws; its panel stays hidden."""
    seen = viewer_frame(outer).evaluate(
        """() => [...document.querySelectorAll("body *")]
            .filter((e) => getComputedStyle(e).visibility === "visible")
            .map((e) => e.tagName)"""
    )
    assert set(seen) == {"CANVAS"}
    opacity = "() => getComputedStyle(document.querySelector('canvas')).opacity"
    assert viewer_frame(outer).evaluate(opacity) == "1"


def test_the_ground_follows_the_pages_theme(outer: Page):
    """At first, and when the page's theme changes."""
    ground = "() => getComputedStyle(document.body).backgroundColor"
    frame = viewer_frame(outer)
    assert frame.evaluate(ground) == "rgb(233, 236, 239)"
    outer.evaluate("document.documentElement.dataset.theme = 'dark'")
    wait_for(frame, f"({ground})() === 'rgb(18, 22, 27)'")


def test_keys_in_the_view_go_to_the_page(outer: Page):
    """Pressed after a click into the picture; viser's own camera keys do nothing."""
    outer.evaluate(
        """() => {
            globalThis.keys = [];
            addEventListener("message", ({ data, source, origin }) => {
                if (source === frames[0] && origin === location.origin)
                    keys.push([data.type, data.code, data.shiftKey]);
            });
        }"""
    )
    frame = viewer_frame(outer)
    camera = "() => globalThis.__viserMutable.camera.position.toArray()"
    frame.evaluate("window.focus()")
    before = frame.evaluate(camera)
    frame.evaluate(
        """() => {
            for (const type of ["keydown", "keyup"])
                document.body.dispatchEvent(
                    new KeyboardEvent(type, { code: "KeyW", shiftKey: true, bubbles: true }));
        }"""
    )
    wait_for(outer.main_frame, "keys.length === 2")
    assert outer.evaluate("keys") == [["keydown", "KeyW", True], ["keyup", "KeyW", True]]
    frame.wait_for_timeout(200)
    assert frame.evaluate(camera) == before


def test_the_view_comes_back_without_focus(outer: Page, server: Server):
    """The client retries only while its document has focus; in our frame it always has."""
    assert viewer_frame(outer).evaluate("document.hasFocus()") is True
    session = viewer_frame(outer).url.split("/view/")[1].split("/")[0]
    wait_for(outer.main_frame, "last.viewers === 1")
    os.kill(server.pid_of(session), signal.SIGKILL)
    wait_for(outer.main_frame, "line.readyState === WebSocket.CLOSED")
    outer.evaluate(DIAL, session)
    again = "last.type === 'status' && last.session === '2' && last.viewers === 1"
    wait_for(outer.main_frame, again)
    wait_for(viewer_frame(outer), DRAWN)


def test_software_gl_can_do_without_antialiasing_and_shadows(outer: Page):
    """The frame's query switches both off, for tests on machines without a graphics card."""
    frame = viewer_frame(outer)
    attributes = "document.querySelector('canvas').getContext('webgl2').getContextAttributes()"
    assert frame.evaluate(attributes)["antialias"] is False
    wait_for(
        frame,
        """() => {
            let casting = 0, lights = 0;
            __viserMutable.scene.traverse((node) => {
                lights += node.isLight === true;
                casting += node.isLight === true && node.castShadow;
            });
            return lights > 0 && casting === 0;
        }""",
    )
