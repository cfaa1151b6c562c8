"""axe-core looks at the page in every state and at every kind of size: no serious finding."""

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page, expect

from tests.page.conftest import OpenPage
from tests.page.fake_server import FakeServer
from tests.page.test_layout import PORTRAIT, STATES, put_into

pytestmark = [pytest.mark.browser, pytest.mark.slow]

DESK, PHONE = (1440, 900), (844, 390)
SERIOUS = ("serious", "critical")
# axe has about ninety rules that it calls fit for an automatic verdict; best practices included.
OPTIONS = {"resultTypes": ["violations", "passes"]}
LEAST_RULES = 15


def findings(page: Page) -> list[str]:
    """What axe calls serious or critical, with the elements concerned."""
    response = Axe().run(page, options=OPTIONS).response
    assert len(response["passes"]) >= LEAST_RULES, "axe has looked at hardly anything"
    return [
        f"{rule['id']} ({rule['impact']}): {rule['help']}: {node['html'][:120]}"
        for rule in response["violations"]
        if rule["impact"] in SERIOUS
        for node in rule["nodes"]
    ]


def open_part(page: Page, part: str) -> None:
    """Open the drawer, the help, the menu, the pads' sheet, or nothing."""
    if part == "drawer":
        page.locator("#options").click()
        expect(page.locator("#drawer")).to_be_visible()
    elif part == "help":
        page.keyboard.press("h")
        expect(page.locator("#help")).to_be_visible()
    elif part == "menu":
        page.locator("#more").click()
        expect(page.locator("#menu")).to_be_visible()


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("size", [DESK, PHONE, PORTRAIT], ids=["desk", "phone", "portrait"])
def test_no_part_of_the_page_has_a_serious_finding(
    fake: FakeServer, open_page: OpenPage, size: tuple[int, int], theme: str
) -> None:
    """At rest, then with each part open that opens."""
    script = f"localStorage.setItem('hindsight.theme', '\"{theme}\"');"
    page = open_page(size=size, script=script, reduced_motion="reduce")
    found = {"rest": findings(page)}
    for part, opener in (("menu", "#more"), ("drawer", "#options"), ("help", "body")):
        if not page.locator(opener).is_visible():
            continue  # this size has another way to it, looked at at the other sizes
        open_part(page, part)
        found[part] = findings(page)
        page.keyboard.press("Escape")
    assert len(found) >= 3
    assert not any(found.values()), found


@pytest.mark.parametrize("state", STATES[1:])
def test_no_state_has_a_serious_finding(fake: FakeServer, open_page: OpenPage, state: str) -> None:
    """Overlay, banners, many objects."""
    page = open_page(size=DESK, seen=state != "first", reduced_motion="reduce")
    put_into(state, fake, page)
    assert findings(page) == []


def test_a_watching_page_has_no_serious_finding(fake: FakeServer, open_page: OpenPage) -> None:
    """What is on a projector: everything there, nothing to steer."""
    fake.hello["control"] = False
    page = open_page(size=DESK, reduced_motion="reduce")
    expect(page.get_by_test_id("banner-watching")).to_be_visible()
    assert findings(page) == []


def test_axe_would_say_so(open_page: OpenPage) -> None:
    """A button without a name is a finding: the check can fail."""
    page = open_page(size=DESK)
    page.evaluate("document.querySelector('#options').replaceChildren()")
    page.evaluate("document.querySelector('#options').removeAttribute('aria-label')")
    page.evaluate("document.querySelector('#options').removeAttribute('title')")
    assert any("button-name" in finding for finding in findings(page))
