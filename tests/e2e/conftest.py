"""A running server for each end-to-end test, and one browser for all."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.browser import chromium
from tests.server import Server, running_server

DRIVER = Path(__file__).with_name("driver.js").read_text()
GAMEPAD = """
window.pad = {id: 'Test pad', index: 0, connected: true, mapping: 'standard', timestamp: 0,
  axes: [0, 0, 0, 0],
  buttons: Array.from({length: 17}, () => ({pressed: false, touched: false, value: 0}))};
Navigator.prototype.getGamepads = () => [null, window.pad];
"""


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    """`hindsight run` with an empty folder of sessions.

    One for each test: sessions that a page has left live on for a minute, and several of them
    beside a browser that draws in software slow the one under test.
    """
    with running_server(tmp_path) as running:
        yield running


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A headless Chromium."""
    with chromium() as running:
        yield running
