"""One stand-in server and one browser for all tests of the page; a fresh session for each."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from app.browser import find_browser
from tests.page.fake_server import FakeServer, fake_server

# A person's second visit: the first-time overlay was seen.
SEEN = "localStorage.setItem('hindsight.coached', 'true')"
POINTERS = """
window.pointer = (side, kind, x, y, id = side === 'left' ? 11 : 12) => {
  const stick = document.querySelector(`[data-testid=stick-${side}]`);
  const box = stick.getBoundingClientRect();
  stick.dispatchEvent(new PointerEvent(kind, {bubbles: true, cancelable: true, pointerId: id,
    pointerType: 'touch', button: 0, clientX: box.x + box.width / 2 + 0.3 * box.width * x,
    clientY: box.y + box.height / 2 - 0.3 * box.width * y}));
};
"""

FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)

AUDITS = Path(__file__).with_name("audits.js").read_text()

OpenPage = Callable[..., Page]


@pytest.fixture(scope="session")
def _server() -> Iterator[FakeServer]:
    with fake_server() as running:
        yield running


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """A headless Chromium; without GL, since the stand-in's viewer draws nothing.

    Closed when this folder is through: Playwright runs once in a process at a time.
    """
    path = find_browser()
    assert path, "no Chromium found: `make browser` installs it or says how"
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        yield running
        running.close()


@pytest.fixture
def fake(_server: FakeServer) -> FakeServer:
    """The stand-in, with nothing left of the last test."""
    _server.reset()
    return _server


@pytest.fixture
def open_page(fake: FakeServer, browser: Browser) -> Iterator[OpenPage]:
    """Opens the page in a context of its own; an error in its scripts fails the test."""
    contexts = []
    errors: list[str] = []

    def open_it(
        query: str = "",
        size: tuple[int, int] = (1100, 700),
        script: str = "",
        seen: bool = True,
        **options: Any,
    ) -> Page:
        context = browser.new_context(viewport={"width": size[0], "height": size[1]}, **options)
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda message: errors.extend(_policy_violation(message.text)))
        page.add_init_script(AUDITS + POINTERS + (SEEN if seen else "") + "\n" + script)
        page.goto(fake.url + "/" + query)
        page.wait_for_selector('[data-testid="connection"][data-state="connected"]')
        page.wait_for_selector('[data-testid="hand"][data-x]', state="attached")
        return page

    yield open_it
    for context in contexts:
        context.close()
    # What a closed page had still on its way must not count for the next test.
    fake.wait(lambda: fake.pages == 0, "its sockets are gone")
    assert not errors, f"the page threw: {errors}"


def _policy_violation(text: str) -> list[str]:
    return [text] if "Content Security Policy" in text else []


def newest_axes(fake: FakeServer) -> tuple[float, float, float, float]:
    """Left x, left y, right x, right y of the newest input, to three digits."""
    inputs = fake.of_type("input")
    if not inputs:
        return (0.0, 0.0, 0.0, 0.0)
    lx, ly, rx, ry = (round(value, 3) + 0.0 for value in inputs[-1]["left"] + inputs[-1]["right"])
    return lx, ly, rx, ry
