"""Every state at every size: nothing overlaps, text is legible, targets are hit, names are said."""

from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.page.conftest import OpenPage
from tests.page.fake_server import FakeServer

pytestmark = [pytest.mark.browser, pytest.mark.slow]

SIZES = [(1440, 900), (1920, 1080), (1366, 768), (1100, 800), (1024, 768), (844, 390), (667, 375)]
PORTRAIT = (390, 844)
PARTS = (
    ".trial, .goals, .status, .view, .side, .dock, .stick, .round, .banner, .tip, .msg, .lbl, .turn"
)


def put_into(state: str, fake: FakeServer, page: Page) -> None:
    """Bring the page into one of its states."""
    if state == "outcome":
        fake.status["trial"].update(outcome="wrong_object", phase="done", grasped="canteen")
        expect(page.get_by_test_id("banner-outcome")).to_be_visible()
    elif state == "lost":
        fake.refuse = True
        fake.drop()
        expect(page.get_by_test_id("banner-lost")).to_be_visible()
    elif state == "simulated":
        fake.status["trial"]["simulated"] = True
        expect(page.get_by_test_id("banner-simulated")).to_be_visible()
    elif state == "unheard":
        fake.status["loss"] = "blur"
        expect(page.get_by_test_id("banner-unheard")).to_be_visible()
    elif state == "first":
        expect(page.locator("#coach .msg")).to_be_visible()
    elif state == "five":
        add_objects(fake)
        expect(page.get_by_test_id("goal-carton")).to_be_attached()


def add_objects(fake: FakeServer) -> None:
    """Make it the cluttered scene."""
    objects: list[dict[str, Any]] = [
        *fake.hello["scene"]["objects"],
        {"name": "can", "colour": "goal-4", "kind": "cylinder"},
        {"name": "carton", "colour": "goal-5", "kind": "box"},
    ]
    fake.status["belief"] = {o["name"]: 0.2 for o in objects}
    fake.send({**fake.hello, "scene": {"name": "clutter", "objects": objects}})


STATES = ["trial", "first", "outcome", "lost", "five", "simulated", "unheard"]


@pytest.mark.parametrize("state", STATES)
def test_nothing_overlaps_or_leaves_the_window(fake: FakeServer, open_page: OpenPage, state: str):
    """At every size of window the page is made for, in every state."""
    page = open_page(size=SIZES[0], seen=state != "first", reduced_motion="reduce")
    put_into(state, fake, page)
    found = {}
    for size in (*SIZES, PORTRAIT):
        page.set_viewport_size({"width": size[0], "height": size[1]})
        expect(page.locator(".stage")).to_have_css("width", f"{size[0]}px")
        # Many chips scroll sideways on a phone; all else stays inside.
        found[size] = page.evaluate("(parts) => audits.overlaps(parts)", PARTS)
    assert not any(found.values()), found


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("state", ["trial", "first", "outcome", "lost"])
def test_text_has_the_contrast_to_be_read(
    fake: FakeServer, open_page: OpenPage, state: str, theme: str
):
    """4.5:1 at least, with the scene behind the panels taken as black (as dark as it gets)."""
    script = f"localStorage.setItem('hindsight.theme', '\"{theme}\"');"
    page = open_page(
        size=(1440, 900), seen=state != "first", script=script, reduced_motion="reduce"
    )
    put_into(state, fake, page)
    page.evaluate("document.querySelector('#help').showModal()")
    assert page.evaluate("audits.contrasts()") == []
    page.evaluate("document.querySelector('#help').close()")
    page.evaluate("document.querySelector('#options').click()")
    assert page.evaluate("audits.contrasts()") == []


def test_every_control_says_its_name(open_page: OpenPage):
    """To a screen reader, with everything open that opens."""
    page = open_page(size=(1440, 900))
    page.locator("#options").click()
    page.evaluate("document.querySelector('#menu').hidden = false")
    assert page.evaluate("audits.nameless()") == []


def test_a_finger_hits_every_control_on_a_phone(fake: FakeServer, open_page: OpenPage):
    """44 pixels at least, in the sheet, too."""
    page = open_page(size=(844, 390), has_touch=True, is_mobile=True, reduced_motion="reduce")
    assert page.evaluate("audits.small()") == []
    page.locator("#more").click()
    expect(page.locator("#menu")).to_be_visible()
    page.locator(".layers-btn").click()
    expect(page.get_by_test_id("layer-user")).to_be_visible()
    assert page.evaluate("audits.small()") == []


def test_a_phone_upright_is_told_but_not_blocked(fake: FakeServer, open_page: OpenPage):
    """Turning helps; the sticks work all the same."""
    page = open_page(size=PORTRAIT, has_touch=True)
    expect(page.locator(".turn")).to_be_visible()
    page.get_by_test_id("grasp").click()
    fake.wait(lambda: fake.commands() == [("grasp", {})], "Grasp works")
    page.set_viewport_size({"width": 844, "height": 390})
    expect(page.locator(".turn")).to_be_hidden()


def test_motion_stops_where_it_is_not_wanted(open_page: OpenPage):
    """`prefers-reduced-motion` ends every transition and animation."""
    page = open_page(reduced_motion="reduce")
    page.locator("#options").click()
    assert page.evaluate("audits.moving()") == 0


def test_the_phones_methods_are_a_menu(fake: FakeServer, open_page: OpenPage):
    """One line has no room for five buttons."""
    page = open_page(size=(844, 390))
    page.get_by_label("Method", exact=True).and_(page.locator("select")).select_option("blend")
    fake.wait(lambda: fake.commands() == [("method", {"method": "blend"})], "it is asked for")
