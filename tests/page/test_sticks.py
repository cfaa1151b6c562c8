"""The on-screen sticks send what they show."""

import re
from itertools import pairwise
from statistics import median

import pytest
from playwright.sync_api import expect

from tests.page.conftest import OpenPage, newest_axes
from tests.page.fake_server import FakeServer

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def test_a_push_is_sent_in_units_of_the_knobs_travel(fake: FakeServer, open_page: OpenPage):
    """Up and right are positive; beyond the travel the stick is full in the same direction."""
    page = open_page()
    page.evaluate("pointer('right', 'pointerdown', 0, 0); pointer('right', 'pointermove', .5, .25)")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0.5, 0.25), "the push arrives")
    newest = fake.of_type("input")[-1]
    assert (newest["device"], newest["mode"], newest["dead_zone"]) == ("pointer", "translate", 0.1)
    page.evaluate("pointer('right', 'pointermove', 3, -4)")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0.6, -0.8), "a full push arrives")


def test_two_sticks_work_at_once(fake: FakeServer, open_page: OpenPage):
    """One finger on each stick; releasing one leaves the other."""
    page = open_page()
    page.evaluate("""() => {
      pointer('left', 'pointerdown', 0, 0); pointer('right', 'pointerdown', 0, 0);
      pointer('left', 'pointermove', 0, 0.7); pointer('right', 'pointermove', -0.4, 0);
    }""")
    fake.wait(lambda: newest_axes(fake) == (0, 0.7, -0.4, 0), "both pushes arrive")
    page.evaluate("pointer('right', 'pointerup', 0, 0)")
    fake.wait(lambda: newest_axes(fake) == (0, 0.7, 0, 0), "one is released")


def test_sticks_work_with_real_fingers(fake: FakeServer, open_page: OpenPage):
    """Two trusted touches, as a touch screen makes them, and a tap on Grasp while they hold."""
    page = open_page(has_touch=True)
    session = page.context.new_cdp_session(page)

    def centre(name: str) -> tuple[float, float]:
        box = page.get_by_test_id(name).bounding_box()
        assert box
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def touch(kind: str, *points: tuple[int, float, float]) -> None:
        touches = [{"id": i, "x": x, "y": y} for i, x, y in points]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})

    (lx, ly), (rx, ry), (gx, gy) = map(centre, ("stick-left", "stick-right", "grasp"))
    touch("touchStart", (0, lx, ly), (1, rx, ry))
    touch("touchMove", (0, lx, ly - 200), (1, rx + 200, ry))
    fake.wait(lambda: newest_axes(fake) == (0, 1, 1, 0), "two fingers push")
    touch("touchStart", (0, lx, ly - 200), (1, rx + 200, ry), (2, gx, gy))
    touch("touchEnd", (2, gx, gy))
    fake.wait(lambda: fake.commands() == [("grasp", {})], "the third finger taps Grasp, once")
    assert newest_axes(fake) == (0, 1, 1, 0)
    touch("touchCancel")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0, 0), "a cancelled touch lets go")


def test_a_second_pointer_on_the_same_stick_is_ignored(fake: FakeServer, open_page: OpenPage):
    """Otherwise a palm on the glass would throw the arm about."""
    page = open_page()
    page.evaluate("pointer('right', 'pointerdown', 0, 0); pointer('right', 'pointermove', .5, 0)")
    page.evaluate("pointer('right', 'pointerdown', -1, 0, 99)")
    page.evaluate("pointer('right', 'pointerup', -1, 0, 99)")
    page.evaluate("pointer('right', 'pointermove', .6, 0)")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0.6, 0), "the first finger still steers")


@pytest.mark.parametrize("end", ["pointerup", "pointercancel"])
def test_letting_go_sends_zero_at_once(fake: FakeServer, open_page: OpenPage, end: str):
    """The message after the last push is zero."""
    page = open_page()
    page.evaluate("pointer('right', 'pointerdown', 0, 1)")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0, 1), "the push arrives")
    page.evaluate(f"pointer('right', '{end}', 0, 1)")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0, 0), "zero arrives")


def test_rotate_mode_names_its_axes_and_uses_the_other_one(fake: FakeServer, open_page: OpenPage):
    """Left x is yaw; left y, of no use then, is not sent (it would count as effort)."""
    page = open_page()
    page.get_by_test_id("rotate").click()
    expect(page.get_by_test_id("rotate")).to_have_attribute("aria-pressed", "true")
    page.evaluate("pointer('left', 'pointerdown', .6, .8)")
    fake.wait(lambda: newest_axes(fake) == (0.6, 0, 0, 0), "yaw arrives")
    assert fake.of_type("input")[-1]["mode"] == "rotate"
    expect(page.locator("#left-label")).to_have_text("Yaw")
    expect(page.locator("#right-label")).to_have_text("Roll, pitch")


def test_rest_is_sent_less_often_than_a_push(fake: FakeServer, open_page: OpenPage):
    """60 Hz and 10 Hz, by the page's own stamps; a slow machine only sends less."""
    page = open_page()

    def gaps(count: int) -> list[float]:
        first = len(fake.of_type("input"))
        fake.wait(lambda: len(fake.of_type("input")) >= first + count, "inputs come")
        times = [message["t"] for message in fake.of_type("input")[first:]]
        return [later - earlier for earlier, later in pairwise(times)]

    at_rest = gaps(8)
    assert min(at_rest) >= 95
    page.evaluate("pointer('right', 'pointerdown', 0, 1)")
    fake.wait(lambda: newest_axes(fake) == (0, 0, 0, 1), "the push arrives")
    pushed = gaps(20)
    assert min(pushed) >= 14
    assert median(pushed) < median(at_rest)


def test_sequence_numbers_and_stamps_rise(fake: FakeServer, open_page: OpenPage):
    """Every input is numbered by one more than the last, and stamped no earlier."""
    page = open_page()
    page.evaluate("pointer('right', 'pointerdown', 0, 1)")
    fake.wait(lambda: len(fake.of_type("input")) > 20, "inputs come")
    inputs = fake.of_type("input")
    assert all(b["seq"] == a["seq"] + 1 and b["t"] >= a["t"] for a, b in pairwise(inputs))


def test_the_yaw_follows_the_picture_or_stays_fixed(fake: FakeServer, open_page: OpenPage):
    """Away is what is up in the picture, unless directions are fixed to the robot."""
    turned = "contentWindow.__viserMutable.camera.matrixWorld.elements"
    page = open_page()
    fake.wait(lambda: fake.of_type("input")[-1]["yaw"] == 0, "the picture's up is world x")
    # The same camera, turned by 90° so that world y is up in the picture (three's −x).
    page.evaluate(f"""() => {{ document.querySelector('iframe').{turned} =
      [0,0,-1,0, -1,0,0,0, 0,1,0,0, 0,1.5,-0.4,1]; }}""")
    fake.wait(lambda: abs(fake.of_type("input")[-1]["yaw"] - 1.5708) < 1e-3, "the yaw follows")
    assert abs(float(page.get_by_test_id("compass").get_attribute("data-yaw") or 0) - 1.5708) < 1e-3
    page.locator("#more").click()
    page.get_by_test_id("follow-view").click()
    fake.wait(lambda: fake.of_type("input")[-1]["yaw"] == 0, "fixed directions")


def test_the_pink_arrow_shows_what_assistance_adds(fake: FakeServer, open_page: OpenPage):
    """It starts at the knob and ends beside it, in the stick's frame; none without assistance."""
    page = open_page()
    arrow = page.locator("#stick-right .vec .assist")
    expect(arrow).to_have_attribute("d", re.compile(r"^M0\.000 0\.000L0\.400 0\.500M"))
    fake.status["assist_stick"] = {"left": [0, 0], "right": [0, 0]}
    expect(arrow).to_have_attribute("d", "")
