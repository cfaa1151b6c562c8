"""Gamepads: emulated where the browser would list them."""

import json

import pytest
from playwright.sync_api import expect

from tests.page.conftest import OpenPage, newest_axes
from tests.page.fake_server import FakeServer

pytestmark = [pytest.mark.browser, pytest.mark.slow]

PADS = """
window.pads = [null];
window.plug = (index, id = 'Test pad (STANDARD GAMEPAD)', mapping = 'standard') => {
  window.pads[index] = {id, index, connected: true, mapping, timestamp: 0, axes: [0, 0, 0, 0],
    buttons: Array.from({length: 17}, () => ({pressed: false, touched: false, value: 0}))};
  dispatchEvent(new Event('gamepadconnected'));
};
window.press = (index, button, on) => {
  window.pads[index].buttons[button] = {pressed: on, touched: on, value: Number(on)};
};
Navigator.prototype.getGamepads = () => window.pads;
"""


def test_a_pad_plugged_in_later_steers(fake: FakeServer, open_page: OpenPage):
    """Standard mapping: left y is height, right is the table plane, up is negative on the wire."""
    page = open_page(script=PADS)
    page.evaluate("plug(1)")
    page.wait_for_selector("text=Gamepad connected: Test pad")
    page.evaluate("pads[1].axes = [0.3, -0.5, 0.6, -0.25]")
    fake.wait(lambda: newest_axes(fake) == (0, 0.5, 0.6, 0.25), "the pad arrives")
    assert fake.of_type("input")[-1]["device"] == "gamepad"
    device = page.get_by_test_id("input-device")
    expect(device).to_have_attribute("data-device", "gamepad")
    expect(device).to_contain_text("Test pad")


def test_an_unplugged_pad_stops_and_the_sticks_go_on(fake: FakeServer, open_page: OpenPage):
    """Its last push does not stay."""
    page = open_page(script=PADS)
    page.evaluate("plug(0)")
    page.wait_for_selector("text=Gamepad connected")
    page.evaluate("pads[0].axes = [0, 0, 1, 0]")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "the pad pushes")
    page.evaluate("pads[0] = null")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0, 0), "zero after unplugging")
    page.evaluate("pointer('right', 'pointerdown', 0, 1)")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0, 1), "the on-screen stick takes over")


def test_noise_within_the_dead_zone_does_not_take_over(fake: FakeServer, open_page: OpenPage):
    """A pad that lies on the table leaves the sticks in charge."""
    page = open_page(script=PADS)
    page.evaluate("plug(0)")
    page.wait_for_selector("text=Gamepad connected")
    page.evaluate("pointer('right', 'pointerdown', 0.5, 0)")
    page.evaluate("pads[0].axes = [0.05, 0.06, -0.05, 0.04]")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0.5, 0), "the stick steers")
    assert fake.of_type("input")[-1]["device"] == "pointer"


def test_the_device_pushed_last_wins(fake: FakeServer, open_page: OpenPage):
    """And hands back when it comes to rest while the other is still pushed."""
    page = open_page(script=PADS)
    page.evaluate("plug(0)")
    page.wait_for_selector("text=Gamepad connected")
    page.evaluate("pointer('right', 'pointerdown', 1, 0)")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "the stick steers")
    page.evaluate("pads[0].axes = [0, 0, 0, -1]")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0, 1), "the pad takes over")
    page.evaluate("pads[0].axes = [0, 0, 0, 0]")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "the stick has it again")


def test_several_pads_work_side_by_side(fake: FakeServer, open_page: OpenPage):
    """Each is a device of its own."""
    page = open_page(script=PADS)
    page.evaluate("plug(0); plug(3, 'Other pad')")
    page.wait_for_selector("text=Gamepad connected: Other pad")
    page.evaluate("pads[3].axes = [0, -1, 0, 0]")
    fake.wait(lambda: newest_axes(fake) == (0, 1, 0, 0), "the second pad steers")
    page.evaluate("pads[0].axes = [0, 1, 0, 0]")
    fake.wait(lambda: newest_axes(fake) == (0, -1, 0, 0), "the first, pushed later, wins")


@pytest.mark.parametrize(
    ("button", "command"),
    [(0, "grasp"), (2, "assist"), (3, "new-trial"), (9, "new-trial")],
)
def test_buttons_command_once(fake: FakeServer, open_page: OpenPage, button: int, command: str):
    """A held button is one command."""
    page = open_page(script=PADS)
    page.evaluate("plug(0)")
    page.wait_for_selector("text=Gamepad connected")
    page.evaluate(f"press(0, {button}, true)")
    fake.wait(lambda: [name for name, _ in fake.commands()] == [command], f"{command} arrives")
    page.evaluate(f"press(0, {button}, false)")
    page.evaluate("pads[0].axes = [0, 0, 1, 0]")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "time passes")
    assert len(fake.commands()) == 1


def test_the_shoulder_button_switches_to_rotation(fake: FakeServer, open_page: OpenPage):
    """And the page says so."""
    page = open_page(script=PADS)
    page.evaluate("plug(0)")
    page.wait_for_selector("text=Gamepad connected")
    page.evaluate("press(0, 5, true)")
    page.wait_for_selector('[data-testid="rotate"][aria-pressed="true"]')
    fake.wait(lambda: fake.of_type("input")[-1]["mode"] == "rotate", "the mode is sent")


def test_a_pad_counts_from_its_first_push(fake: FakeServer, open_page: OpenPage):
    """Browsers show a pad only once it is used: that push is meant."""
    page = open_page(script=PADS)
    page.evaluate("plug(0); pads[0].axes = [0, 0, 1, 0]")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "it counts")


def test_a_pad_held_through_a_blur_waits_for_rest(fake: FakeServer, open_page: OpenPage):
    """Whoever comes back to the page with a stick held down moves nothing by it."""
    page = open_page(script=PADS)
    page.evaluate("plug(0); pads[0].axes = [0, 0, 1, 0]")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "it counts")
    page.evaluate("dispatchEvent(new Event('blur')); dispatchEvent(new Event('focus'))")
    before = len(fake.of_type("input"))
    fake.wait(lambda: len(fake.of_type("input")) > before + 3, "inputs go on")
    assert newest_axes(fake) == (0, 0, 0, 0)
    page.evaluate("pads[0].axes = [0, 0, 0, 0]")
    before = len(fake.of_type("input"))
    fake.wait(lambda: len(fake.of_type("input")) > before + 3, "it comes to rest")
    page.evaluate("pads[0].axes = [0, 0, 1, 0]")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "then it counts")


def test_a_mapping_made_in_the_sheet_is_used_and_remembered(fake: FakeServer, open_page: OpenPage):
    """A pad without standard layout: axes and buttons are learnt by moving them."""
    page = open_page(script=PADS)
    page.evaluate("plug(0, 'Odd stick', '')")
    page.wait_for_selector("text=no standard layout")
    page.get_by_test_id("input-device").click()
    page.get_by_label("Change: Right stick, right").click()
    page.evaluate("pads[0].axes = [0, 0.9, 0, 0]")
    page.wait_for_selector("text=Right stick, right is axis 1.")
    page.evaluate("pads[0].axes = [0, 0, 0, 0]")
    page.get_by_label("Change: Grasp").click()
    page.evaluate("press(0, 7, true)")
    page.wait_for_selector("text=Grasp is button 7.")
    page.evaluate("press(0, 7, false)")
    assert all(m["right"] == [0, 0] for m in fake.of_type("input")), "set-up must not steer"
    page.locator("#pads").get_by_label("Close").click()
    page.evaluate("pads[0].axes = [0, 0.5, 0, 0]")
    fake.wait(lambda: newest_axes(fake)[2] == 0.5, "the learnt axis steers")
    page.evaluate("press(0, 7, true)")
    fake.wait(lambda: fake.commands() == [("grasp", {})], "the learnt button grasps")
    stored = json.loads(page.evaluate("localStorage.getItem('hindsight.pad.Odd stick')"))
    assert stored["axes"]["rightX"]["index"] == 1
    assert stored["buttons"]["grasp"] == [7]


def test_calibration_stretches_a_worn_stick_to_its_full_range(
    fake: FakeServer, open_page: OpenPage
):
    """A stick that rests off centre and reaches 0.7 only is made whole."""
    page = open_page(script=PADS)
    page.evaluate("plug(0); pads[0].axes = [0.05, 0, 0.05, 0]")
    page.wait_for_selector("text=Gamepad connected")
    page.get_by_test_id("input-device").click()
    page.get_by_role("button", name="Calibrate").click()
    frames = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
    for value in (0.75, -0.65, 0.05):
        page.evaluate(f"pads[0].axes = [0.05, 0, {value}, 0]; {frames}")
    page.get_by_role("button", name="Done").click()
    page.wait_for_selector("text=Calibrated.")
    page.locator("#pads").get_by_label("Close").click()
    page.evaluate("pads[0].axes = [0.05, 0, 0.4, 0]")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0.5, 0), "half of the way is half")


def test_a_broken_stored_mapping_is_left_aside(fake: FakeServer, open_page: OpenPage):
    """Storage may hold anything."""
    broken = "localStorage.setItem('hindsight.pad.Test pad (STANDARD GAMEPAD)', '{\"axes\": 3}')"
    page = open_page(script=PADS + broken)
    page.evaluate("plug(0)")
    page.wait_for_selector("text=Gamepad connected")
    page.evaluate("pads[0].axes = [0, 0, 1, 0]")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 1, 0), "the standard layout is used")
