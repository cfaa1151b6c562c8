"""A page whose browser sleeps, and a line that breaks again and again."""

import pytest

from tests.page.conftest import OpenPage, newest_axes
from tests.page.fake_server import FakeServer

pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.timeout(600)]
CONNECTED = '[data-testid="connection"][data-state="connected"]'


@pytest.mark.parametrize("dropped", [False, True], ids=["line-held", "line-lost"])
def test_a_frozen_page_wakes_up_where_it_was(
    fake: FakeServer, open_page: OpenPage, dropped: bool
) -> None:
    """Frozen as by a closed lid with the stick pushed: it comes back by itself, and steers."""
    page = open_page()
    page.evaluate("pointer('right', 'pointerdown', 0, 0); pointer('right', 'pointermove', 1, 0)")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "pushed")
    devtools = page.context.new_cdp_session(page)
    devtools.send("Page.setWebLifecycleState", {"state": "frozen"})
    page_count = fake.connections
    if dropped:
        fake.drop()
    devtools.send("Page.setWebLifecycleState", {"state": "active"})
    page.wait_for_selector(CONNECTED)
    if dropped:
        fake.wait(lambda: fake.connections > page_count and fake.pages == 1, "it is back")
    fake.received.clear()
    page.evaluate("pointer('right', 'pointerup', 1, 0)")
    fake.wait(lambda: fake.of_type("input"), "it speaks")
    page.keyboard.down("r")
    fake.wait(lambda: newest_axes(fake) == (0, 1, 0, 0), "and steers")
    numbers = [m["seq"] for m in fake.of_type("input")]
    assert numbers == sorted(set(numbers))


def test_a_page_that_slept_past_its_session_is_told(fake: FakeServer, open_page: OpenPage) -> None:
    """After an hour its session has ended: it comes back to a new one, and says so."""
    page = open_page()
    devtools = page.context.new_cdp_session(page)

    def sleep() -> None:
        before = fake.connections
        devtools.send("Page.setWebLifecycleState", {"state": "frozen"})
        fake.drop()
        devtools.send("Page.setWebLifecycleState", {"state": "active"})
        fake.wait(lambda: fake.connections > before and fake.pages == 1, "it is back")
        page.wait_for_selector(CONNECTED)

    told = page.locator(".notice", has_text="The session had ended while this page was away")
    sleep()
    assert told.count() == 0  # a short sleep: the same session goes on
    fake.hello["run"] = 2
    sleep()
    told.wait_for()


def test_fifty_reconnects_leave_one_line_and_no_litter(
    fake: FakeServer, open_page: OpenPage
) -> None:
    """One socket at the end, each number once, and no element more than after the first drop."""
    page = open_page()

    def drop() -> None:
        before = fake.connections
        fake.drop()
        fake.wait(lambda: fake.pages == 1 and fake.connections > before, "it comes back")
        page.wait_for_selector(CONNECTED)

    def elements() -> int:
        return page.evaluate("document.querySelectorAll('*').length")

    drop()
    page.wait_for_selector(".notice", state="detached")
    before = elements()
    for _ in range(50):
        drop()
    page.wait_for_selector(".notice", state="detached", timeout=60_000)
    assert elements() == before
    assert fake.pages == 1
    numbers = [m["seq"] for m in fake.of_type("input")]
    assert len(numbers) > 50 and len(set(numbers)) == len(numbers)
