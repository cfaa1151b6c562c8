"""What the page does when its user or its line is gone."""

import pytest

from tests.page.conftest import OpenPage, newest_axes
from tests.page.fake_server import FakeServer

pytestmark = [pytest.mark.browser, pytest.mark.slow]

PUSH = "pointer('right', 'pointerdown', 0, 0); pointer('right', 'pointermove', 1, 0)"


def test_blur_sends_zero_and_says_so(fake: FakeServer, open_page: OpenPage):
    """Sticks and keys let go; the server hears blur; a new push says focus first."""
    page = open_page()
    page.evaluate(PUSH)
    page.keyboard.down("r")
    fake.wait(lambda: newest_axes(fake) == (0, 1, 0, 0), "the key, pushed last, steers")
    page.evaluate("dispatchEvent(new Event('blur'))")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0, 0), "zero")
    assert [m["name"] for m in fake.of_type("event")] == ["blur"]
    before = len(fake.of_type("input"))
    fake.wait(lambda: len(fake.of_type("input")) > before + 3, "inputs go on")
    assert newest_axes(fake) == (0, 0, 0, 0)
    page.evaluate(PUSH)
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "pushed anew")
    assert [m["name"] for m in fake.of_type("event")] == ["blur", "focus"]


def test_a_hidden_page_sends_zero(fake: FakeServer, open_page: OpenPage):
    """Another tab in front of it."""
    page = open_page()
    page.evaluate(PUSH)
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "pushed")
    page.evaluate("""() => {
      Object.defineProperty(document, 'hidden', {value: true, configurable: true});
      document.dispatchEvent(new Event('visibilitychange'));
    }""")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0, 0), "zero")
    assert [m["name"] for m in fake.of_type("event")] == ["hidden"]
    page.evaluate("""() => {
      Object.defineProperty(document, 'hidden', {value: false, configurable: true});
      document.dispatchEvent(new Event('visibilitychange'));
    }""")
    fake.wait(lambda: [m["name"] for m in fake.of_type("event")][-1] == "visible", "it is back")


def test_a_dropped_line_is_shown_and_the_sequence_goes_on(fake: FakeServer, open_page: OpenPage):
    """Connected → reconnecting → connected, the same numbers further up, the same trial."""
    page = open_page("?seed=3")
    fake.wait(lambda: fake.commands(), "the query's trial starts")
    page.evaluate("pointer('right', 'pointerdown', 0, 1)")
    fake.wait(lambda: len(fake.of_type("input")) > 10, "inputs come")
    fake.refuse = True
    fake.drop()
    page.wait_for_selector('[data-testid="connection"][data-state="reconnecting"]')
    page.wait_for_selector("text=Connection lost. Policy goes on by itself.")
    assert page.locator("#assertive").inner_text() == "Connection lost. Policy goes on by itself."
    assert page.locator(".status .hz").inner_text() == "–"
    assert page.locator(".status .rtt").inner_text() == "–"
    last = max(m["seq"] for m in fake.of_type("input"))
    fake.received.clear()
    fake.refuse = False
    page.wait_for_selector('[data-testid="connection"][data-state="connected"]')
    fake.wait(lambda: fake.of_type("input"), "inputs come again")
    assert fake.of_type("input")[0]["seq"] > last
    assert fake.commands() == []
    page.wait_for_selector("text=Connection lost", state="hidden")


def test_try_now_does_not_wait(fake: FakeServer, open_page: OpenPage):
    """The banner's button connects at once."""
    page = open_page()
    fake.refuse = True
    fake.drop()
    page.wait_for_selector("text=Trying again in 2 s", timeout=60_000)
    fake.refuse = False
    page.get_by_role("button", name="Try now").click()
    page.wait_for_selector('[data-testid="connection"][data-state="connected"]')


def test_many_reconnects_leave_one_line(fake: FakeServer, open_page: OpenPage):
    """Ten drops in a row: inputs keep coming over one socket, each number once."""
    page = open_page()
    for _ in range(10):
        before = fake.connections
        fake.drop()
        fake.wait(lambda before=before: fake.pages and fake.connections > before, "it comes back")
    page.wait_for_selector('[data-testid="connection"][data-state="connected"]')
    numbers = [m["seq"] for m in fake.of_type("input")]
    assert len(set(numbers)) == len(numbers)


def test_a_reload_goes_on_counting(fake: FakeServer, open_page: OpenPage):
    """The robot refuses numbers it has seen."""
    page = open_page()
    fake.wait(lambda: len(fake.of_type("input")) > 5, "inputs come")
    page.reload()
    page.wait_for_selector('[data-testid="connection"][data-state="connected"]')
    last = len(fake.of_type("input"))
    fake.wait(lambda: len(fake.of_type("input")) > last + 2, "inputs come again")
    numbers = [m["seq"] for m in fake.of_type("input")]
    assert numbers == sorted(set(numbers))


def test_an_ended_session_says_why_and_does_not_retry(fake: FakeServer, open_page: OpenPage):
    """The server's words, and one way on."""
    page = open_page()
    fake.send({"type": "ended", "reason": "The robot's process was killed."})
    page.wait_for_selector('[data-testid="connection"][data-state="lost"]')
    page.wait_for_selector("text=The robot's process was killed.")
    page.get_by_role("button", name="Start again").click()
    page.wait_for_selector('[data-testid="connection"][data-state="connected"]')


def test_a_verdict_in_the_close_code_is_final(fake: FakeServer, open_page: OpenPage):
    """Codes from 4000 on: trying again would not change it."""
    page = open_page()
    fake.drop(4003, "No room for another session.")
    page.wait_for_selector('[data-testid="connection"][data-state="lost"]')
    page.wait_for_selector("text=No room for another session.")


def test_the_round_trip_is_measured_and_reported(fake: FakeServer, open_page: OpenPage):
    """The second ping carries what the first one measured."""
    page = open_page()
    fake.wait(lambda: len(fake.of_type("ping")) >= 2, "pings come")
    assert fake.of_type("ping")[1]["rtt"] >= 0
    assert page.locator(".status .rtt").inner_text().isdigit()


def test_an_unconfirmed_command_is_mentioned(fake: FakeServer, open_page: OpenPage):
    """The person should know that it may not have arrived."""
    page = open_page()

    async def swallow(socket: object, message: dict[str, object]) -> None:
        fake.received.append(message)

    answer, fake._answer = fake._answer, swallow  # type: ignore[method-assign]
    try:
        page.get_by_test_id("new-trial").click()
        fake.wait(lambda: fake.commands(), "the command arrives")
        fake.drop()
        page.wait_for_selector("text=before the robot confirmed: new-trial")
    finally:
        fake._answer = answer  # type: ignore[method-assign]


@pytest.mark.parametrize(
    ("method", "enabled", "hold", "words"),
    [
        ("policy", True, True, "The robot has stopped."),
        ("policy", False, False, "The robot has stopped."),
        ("direct", True, False, "The robot has stopped."),
        ("autonomy", True, False, "Autonomy goes on by itself."),
    ],
)
def test_a_lost_line_says_what_the_arm_does(
    fake: FakeServer, open_page: OpenPage, method: str, enabled: bool, hold: bool, words: str
):
    """It stops under direct control and with `--hold-on-loss`; what helps by itself goes on."""
    fake.hello["hold_on_loss"] = hold
    fake.status["trial"]["method"] = method
    fake.status["settings"] = {**fake.status["settings"], "method": method, "enabled": enabled}
    page = open_page()
    fake.refuse = True
    fake.drop()
    page.wait_for_selector(f"text=Connection lost. {words}")


def test_a_blind_page_does_not_guess_what_the_arm_does(fake: FakeServer, open_page: OpenPage):
    """Where a study hides method and settings."""
    for hidden in ("settings", "settings_id"):
        fake.status.pop(hidden)
    fake.hello.pop("settings")
    fake.status["trial"].pop("method")
    page = open_page()
    fake.refuse = True
    fake.drop()
    page.wait_for_selector("text=Connection lost. Nobody steers the robot.")


def test_input_that_does_not_count_is_said(fake: FakeServer, open_page: OpenPage):
    """The line holds: what to do, and what the arm does meanwhile; gone with the first input."""
    page = open_page()
    banner = page.get_by_test_id("banner-unheard")
    assert banner.is_hidden()
    fake.status["loss"] = "blur"
    banner.get_by_text("Click into the page to steer").wait_for()
    assert "Another window is in front. Policy goes on by itself." in banner.inner_text()
    fake.hello["hold_on_loss"] = True
    fake.send(fake.hello)
    banner.get_by_text("Another window is in front. The robot stands still.").wait_for()
    fake.status["loss"] = ""
    banner.wait_for(state="hidden")
