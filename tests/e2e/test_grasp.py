"""A person at the page grasps the objects: real browser, real server, real physics."""

from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from tests.browser import open_page
from tests.e2e.conftest import DRIVER, GAMEPAD
from tests.server import Server

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]
GLASS = "glass"
OBJECTS = ("canteen", "block", GLASS)


def slow(name: str) -> Any:
    """A parameter that only `make test-all` takes."""
    return pytest.param(name, marks=pytest.mark.slow)


def start(page: Page, target: str) -> None:
    """Wait until the page is connected and the trial for this target runs."""
    page.wait_for_selector('[data-testid="connection"][data-state="connected"]', timeout=60_000)
    page.wait_for_selector(
        f'[data-testid="trial"][data-target="{target}"][data-outcome="running"]', timeout=60_000
    )
    page.wait_for_selector('[data-testid="hand"][data-x]', state="attached")
    page.evaluate(DRIVER)


def grasp(page: Page, target: str, device: str = "sticks") -> str:
    """Let the driver grasp; the outcome the page shows."""
    start(page, target)
    return page.evaluate("([name, device]) => driver.grasp(name, {device})", [target, device])


@pytest.mark.parametrize("target", [GLASS, *(slow(name) for name in OBJECTS if name != GLASS)])
@pytest.mark.parametrize("method", ["policy", slow("blend"), slow("direct")])
def test_the_sticks_grasp(server: Server, browser: Browser, method: str, target: str):
    """Steering by eye through the on-screen sticks grasps every object under every method."""
    seed = OBJECTS.index(target)
    with open_page(browser, f"{server.url}/?method={method}&target={target}&seed={seed}") as page:
        assert grasp(page, target) == "grasped"
        trial = page.get_by_test_id("trial")
        assert float(trial.get_attribute("data-seconds") or 0) > 0.5
        assert float(trial.get_attribute("data-input") or 0) > 0.1
        pressed = page.get_by_test_id(f"method-{method}").get_attribute("aria-pressed")
        assert pressed == "true"


@pytest.mark.slow
def test_a_gamepad_grasps(server: Server, browser: Browser):
    """A pad with the standard mapping, plugged in after the page has opened, does it too."""
    with open_page(browser, f"{server.url}/?method=policy&target=glass&seed=5") as page:
        page.evaluate(GAMEPAD)
        page.evaluate("dispatchEvent(new Event('gamepadconnected'))")
        assert grasp(page, "glass", "gamepad") == "grasped"
        assert page.get_by_test_id("input-device").get_attribute("data-device") == "gamepad"


@pytest.mark.slow
def test_the_keyboard_grasps(server: Server, browser: Browser):
    """WASD, R/F and space do it too."""
    with open_page(browser, f"{server.url}/?method=policy&target=block&seed=6") as page:
        assert grasp(page, "block", "keyboard") == "grasped"
        assert page.get_by_test_id("input-device").get_attribute("data-device") == "keyboard"


@pytest.mark.slow
def test_belief_follows_the_sticks(server: Server, browser: Browser):
    """The cards show probabilities that sum to one and end on the instructed object."""
    with open_page(browser, f"{server.url}/?method=policy&target=canteen&seed=7") as page:
        assert grasp(page, "canteen") == "grasped"
        shown = [
            float(page.get_by_test_id(f"goal-{name}").get_attribute("data-probability") or "nan")
            for name in OBJECTS
        ]
        assert sum(shown) == pytest.approx(1.0, abs=0.02)
        assert max(shown) == shown[0]
