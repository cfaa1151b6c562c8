"""While nobody touches a stick, a simulated user drives, and the page says so."""

import math
import re

import pytest
from playwright.sync_api import Page

from tests.page.conftest import OpenPage, newest_axes
from tests.page.fake_server import FakeServer

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def knob(page: Page, side: str) -> tuple[float, float]:
    """Where a stick's knob stands, right and up, full stick = 1."""
    style = page.get_by_test_id(f"stick-{side}").get_attribute("style") or ""
    found = dict(re.findall(r"--([xy]): *([-+.e0-9]+)", style))
    return round(float(found["x"]), 6) + 0.0, round(float(found["y"]), 6) + 0.0


def test_a_simulated_user_is_named_and_shown_at_the_sticks(fake: FakeServer, open_page: OpenPage):
    """No lesson for beginners; the knob stands where it is pushed, as this view sees it."""
    fake.status["trial"]["simulated"] = True
    page = open_page(seen=False)
    banner = page.get_by_test_id("banner-simulated")
    assert "Touch a stick to take over" in banner.inner_text()
    assert page.locator("#coach").is_hidden()
    assert "A simulated user is driving" in page.locator("#polite").inner_text()
    yaw = float(page.get_by_test_id("compass").get_attribute("data-yaw") or "nan")
    fake.status["sticks"] = {
        "left": [0, 0.5],
        "right": [0.0, 0.8],
        "mode": "translate",
        "yaw": yaw + math.pi / 2,
    }
    fake.wait(lambda: knob(page, "left") == (0.0, 0.5), "the left knob stands where it is pushed")
    fake.wait(lambda: knob(page, "right") == (-0.8, 0.0), "the right one as seen from here")
    assert newest_axes(fake) == (0, 0, 0, 0)  # what is shown is not sent

    page.evaluate("pointer('right', 'pointerdown', 0, 0); pointer('right', 'pointermove', 1, 0)")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "the visitor's push arrives")
    fake.status["trial"]["simulated"] = False
    banner.wait_for(state="hidden")
    fake.wait(lambda: knob(page, "right") == (1.0, 0.0), "the visitor's own push")


def test_who_watches_is_told_too(fake: FakeServer, open_page: OpenPage):
    """A projector's page has no sticks to touch."""
    fake.hello["control"] = False
    fake.status["trial"]["simulated"] = True
    page = open_page()
    page.get_by_test_id("banner-watching").get_by_text("A simulated user is driving.").wait_for()
    assert page.get_by_test_id("banner-simulated").is_hidden()
