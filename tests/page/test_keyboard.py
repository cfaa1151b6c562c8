"""Keys steer and command; every control can be reached and used without a pointer."""

import math

import pytest
from playwright.sync_api import Page

from tests.page.conftest import OpenPage, newest_axes
from tests.page.fake_server import FakeServer

pytestmark = [pytest.mark.browser, pytest.mark.slow]

HALF = round(math.sqrt(0.5), 3)


@pytest.mark.parametrize(
    ("keys", "axes"),
    [
        ("w", (0, 0, 0, 1)),
        ("s", (0, 0, 0, -1)),
        ("a", (0, 0, -1, 0)),
        ("d", (0, 0, 1, 0)),
        ("r", (0, 1, 0, 0)),
        ("f", (0, -1, 0, 0)),
        ("wd", (0, 0, HALF, HALF)),
        ("ad", (0, 0, 0, 0)),
        ("wr", (0, 1, 0, 1)),
    ],
)
def test_held_keys_push_the_sticks(
    fake: FakeServer, open_page: OpenPage, keys: str, axes: tuple[float, ...]
):
    """Diagonals are no longer than straight pushes; opposite keys cancel."""
    page = open_page()
    for key in keys:
        page.keyboard.down(key)
    fake.wait(lambda: newest_axes(fake) == axes, f"{keys} arrives")
    if any(axes):
        assert fake.of_type("input")[-1]["device"] == "keyboard"
    for key in keys:
        page.keyboard.up(key)
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0, 0), "released")


def test_shift_slows_a_held_key(fake: FakeServer, open_page: OpenPage):
    """For the last centimetre."""
    page = open_page()
    page.keyboard.down("w")
    fake.wait(lambda: newest_axes(fake)[3] == 1, "full")
    page.keyboard.down("Shift")
    fake.wait(lambda: newest_axes(fake)[3] == 0.4, "slow")
    page.keyboard.up("Shift")
    fake.wait(lambda: newest_axes(fake)[3] == 1, "full again")


def test_rotate_mode_maps_r_and_f_to_yaw(fake: FakeServer, open_page: OpenPage):
    """M switches what the sticks command, while keys are held, too."""
    page = open_page()
    page.keyboard.down("f")
    fake.wait(lambda: newest_axes(fake) == (0, -1, 0, 0), "down")
    page.keyboard.press("m")
    fake.wait(lambda: newest_axes(fake) == (1, 0, 0, 0), "yaw")
    assert fake.of_type("input")[-1]["mode"] == "rotate"


@pytest.mark.parametrize(
    ("key", "command"),
    [
        (" ", ("grasp", {})),
        ("n", ("new-trial", {})),
        ("g", ("assist", {"enabled": False})),
        ("1", ("method", {"method": "direct"})),
        ("5", ("method", {"method": "autonomy"})),
    ],
)
def test_keys_command(
    fake: FakeServer, open_page: OpenPage, key: str, command: tuple[str, dict[str, object]]
):
    """One press is one command, also when the key repeats."""
    page = open_page()
    page.keyboard.down(key)
    page.keyboard.down(key)  # playwright sends it as a repeat
    page.keyboard.up(key)
    fake.wait(lambda: fake.commands() == [command], f"{key!r} commands {command}")


def test_space_starts_the_next_trial_after_an_outcome(fake: FakeServer, open_page: OpenPage):
    """And not another grasp."""
    page = open_page()
    fake.status["trial"].update(outcome="knocked_over", phase="done")
    page.wait_for_selector('[data-testid="trial"][data-outcome="knocked_over"]')
    page.keyboard.press(" ")
    fake.wait(lambda: fake.commands() == [("new-trial", {})], "space goes on")


def test_h_opens_and_closes_the_help(open_page: OpenPage):
    """Keys do not steer the arm behind an open sheet."""
    page = open_page()
    page.keyboard.press("h")
    page.wait_for_selector("#help[open]")
    page.keyboard.press("h")
    page.wait_for_selector("#help:not([open])", state="attached")


def test_no_key_steers_behind_a_sheet(fake: FakeServer, open_page: OpenPage):
    """An open dialog has the keyboard for itself."""
    page = open_page()
    page.keyboard.press("h")
    page.wait_for_selector("#help[open]")
    page.keyboard.down("w")
    before = len(fake.of_type("input"))
    fake.wait(lambda: len(fake.of_type("input")) > before + 3, "inputs go on")
    assert all(m["right"] == [0, 0] for m in fake.of_type("input")[before:])


def test_keys_pressed_in_the_picture_steer(fake: FakeServer, open_page: OpenPage):
    """A click into the picture takes the focus; the viewer hands its keys to the page."""
    page = open_page()
    page.mouse.click(700, 450)
    assert page.evaluate("document.activeElement.tagName") == "IFRAME"
    page.keyboard.down("d")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "the key arrives through the frame")
    page.keyboard.up("d")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0, 0), "its release, too")


def test_messages_of_strangers_are_no_keys(fake: FakeServer, open_page: OpenPage):
    """Only the picture's window may post keys."""
    page = open_page()
    page.evaluate("postMessage({type: 'keydown', code: 'Space'}, '*')")
    page.keyboard.press("n")
    fake.wait(lambda: fake.commands(), "a later command arrives")
    assert fake.commands() == [("new-trial", {})]


def test_a_clicked_button_gives_the_space_bar_back(fake: FakeServer, open_page: OpenPage):
    """Space after a click on a method closes the hand instead of pressing the button again."""
    page = open_page()
    page.get_by_test_id("method-blend").click()
    page.keyboard.press(" ")
    fake.wait(lambda: len(fake.commands()) == 2, "two commands")
    assert fake.commands() == [("method", {"method": "blend"}), ("grasp", {})]


def test_arrow_keys_push_the_stick_with_the_focus(fake: FakeServer, open_page: OpenPage):
    """Either stick, by its own four keys."""
    page = open_page()
    page.get_by_test_id("stick-left").focus()
    page.keyboard.down("ArrowUp")
    fake.wait(lambda: newest_axes(fake) == (0, 1, 0, 0), "left stick up")
    page.keyboard.up("ArrowUp")
    page.get_by_test_id("stick-right").focus()
    page.keyboard.down("ArrowLeft")
    fake.wait(lambda: newest_axes(fake) == (0, 0, -1, 0), "right stick left")


NAME = """(e) => e.dataset.testid || e.id || e.innerText.trim() || e.getAttribute('aria-label')"""


def walk(page: Page) -> list[str]:
    """What Tab reaches after the first control, each by its test id, id or text."""
    page.get_by_test_id("input-device").focus()
    seen: list[str] = []
    while True:
        body, name = page.evaluate(
            f"[document.activeElement === document.body, ({NAME})(document.activeElement)]"
        )
        if body or name in seen:
            return seen
        seen.append(name)
        page.keyboard.press("Tab")


def test_tab_reaches_every_control_in_reading_order(open_page: OpenPage):
    """Status, view, method, assist, options, new trial, sticks, grasp; with nothing left out."""
    page = open_page(size=(1440, 900))
    page.locator("#options").click()
    page.wait_for_selector("#drawer")
    reached = walk(page)
    reachable = page.evaluate(
        f"""[...document.querySelectorAll('button, input, select, textarea, a, [tabindex="0"]')]
          .filter(e => e.checkVisibility() && !e.disabled && !e.closest('fieldset:disabled'))
          .map({NAME})"""
    )
    assert sorted(reached) == sorted(reachable)
    landmarks = [
        "input-device",
        "Operator",
        "layer-user",
        "method-direct",
        "assist-toggle",
        "options",
        "new-trial",
        "stick-left",
        "stick-right",
        "grasp",
    ]
    positions = [reached.index(name) for name in landmarks]
    assert positions == sorted(positions)


def test_space_presses_the_button_that_tab_reached(fake: FakeServer, open_page: OpenPage):
    """With the keyboard alone, a focused button keeps its space bar."""
    page = open_page()
    while page.evaluate("document.activeElement.dataset.testid") != "method-yielding":
        page.keyboard.press("Tab")
    page.keyboard.press(" ")
    fake.wait(lambda: fake.commands() == [("method", {"method": "yielding"})], "it is pressed")


def test_escape_closes_the_drawer_and_the_menu(open_page: OpenPage):
    """And the focus goes back to what opened them."""
    page = open_page()
    for opener, panel in (("#options", "#drawer"), ("#more", "#menu")):
        page.locator(opener).click()
        page.wait_for_selector(panel)
        page.keyboard.press("Escape")
        page.wait_for_selector(panel, state="hidden")
        assert page.evaluate("'#' + document.activeElement.id") == opener
