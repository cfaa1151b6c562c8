"""What the page shows, what it asks for, and that text stays text."""

import json
import re

import pytest
from playwright.sync_api import expect

from tests.page.conftest import OpenPage
from tests.page.fake_server import FakeServer

pytestmark = pytest.mark.browser

TEST_IDS = [
    "viewer",
    "stick-left",
    "stick-right",
    "grasp",
    *(f"method-{name}" for name in ("direct", "blend", "policy", "yielding", "autonomy")),
    "assist-toggle",
    "goal-canteen",
    "goal-block",
    "goal-glass",
    "new-trial",
    "trial",
    "connection",
    "input-device",
    "hand",
    "object-canteen",
    "object-block",
    "object-glass",
]


def test_every_name_that_drivers_rely_on_is_there_once(open_page: OpenPage):
    """The test ids of the contract."""
    page = open_page()
    assert {name: page.get_by_test_id(name).count() for name in TEST_IDS} == dict.fromkeys(
        TEST_IDS, 1
    )


def test_the_figures_of_the_status_reach_the_document(fake: FakeServer, open_page: OpenPage):
    """Trial, beliefs and positions, as numbers in attributes."""
    page = open_page("?detail=full")
    trial = page.get_by_test_id("trial")
    expect(trial).to_have_attribute("data-target", "glass")
    expect(trial).to_have_attribute("data-outcome", "running")
    expect(trial).to_have_attribute("data-seconds", "14.2")
    expect(trial).to_have_attribute("data-input", "5.8")
    expect(trial).to_contain_text("Grasp the glass")
    expect(page.get_by_test_id("goal-block")).to_have_attribute("data-probability", "0.19")
    expect(page.get_by_test_id("goal-block")).to_contain_text("0.19")
    for axis, value in zip("xyz", fake.status["hand"], strict=True):
        expect(page.get_by_test_id("hand")).to_have_attribute(f"data-{axis}", str(value))
    expect(page.get_by_test_id("object-block")).to_have_attribute("data-x", "0.52")
    expect(page.get_by_test_id("viewer")).to_have_attribute(
        "src", "/view/test-session/?hideViserLogo"
    )


def test_software_drawing_is_found_and_spared(open_page: OpenPage):
    """This browser draws in software: the picture leaves out what costs most, unless asked."""
    view = "/view/test-session/?hideViserLogo"
    spared = f"{view}&antialias=0&shadows=0&surroundings=0&fixedDpr=0.6"
    expect(open_page("?websocket=evil").get_by_test_id("viewer")).to_have_attribute("src", spared)
    expect(open_page("?detail=plain").get_by_test_id("viewer")).to_have_attribute("src", spared)
    expect(open_page("?detail=full").get_by_test_id("viewer")).to_have_attribute("src", view)


def test_hidden_figures_leave_no_trace(fake: FakeServer, open_page: OpenPage):
    """A study's status may lack belief, method, positions: the page shows none and goes on."""
    page = open_page()
    for key in ("belief", "reason", "hand", "objects", "settings", "loop", "assist_stick"):
        del fake.status[key]
    del fake.status["trial"]["method"]
    expect(page.locator("#goals")).to_be_hidden()
    expect(page.locator("#side")).to_be_hidden()
    expect(page.locator(".tag")).to_have_count(0)
    expect(page.get_by_test_id("hand")).not_to_have_attribute("data-x", re.compile(".*"))
    expect(page.get_by_test_id("object-glass")).to_have_count(0)


def test_the_query_starts_that_trial_once(fake: FakeServer, open_page: OpenPage):
    """Seed as a number; not again after a dropped line."""
    page = open_page("?method=blend&target=block&seed=12&scene=clutter")
    asked = {"method": "blend", "target": "block", "seed": 12, "scene": "clutter"}
    fake.wait(lambda: fake.commands() == [("new-trial", asked)], "the trial is asked for")
    expect(page.get_by_test_id("trial")).to_have_attribute("data-target", "block")
    expect(page.get_by_test_id("method-blend")).to_have_attribute("aria-pressed", "true")
    before = fake.connections
    fake.drop()
    fake.wait(lambda: fake.connections > before and fake.pages, "the page comes back")
    assert len(fake.commands()) == 1


def test_a_refused_query_is_said_in_the_robots_words(fake: FakeServer, open_page: OpenPage):
    """Values are judged by the worker; its objection becomes a notice."""
    fake.objections["new-trial"] = "target is 'mug'; valid: canteen, block, glass"
    page = open_page("?target=mug&seed=x")
    expect(page.locator(".notice")).to_contain_text("target is 'mug'; valid: canteen, block, glass")
    assert fake.commands() == [("new-trial", {"target": "mug", "seed": "x"})]


def test_hostile_text_is_shown_as_text(fake: FakeServer, open_page: OpenPage):
    """In notices, reasons, outcomes and reasons of an end."""
    evil = '<img src=x onerror="window.hit=1"><script>window.hit=1</script>'
    page = open_page(size=(1440, 900))
    fake.send({"type": "notice", "level": "warn", "text": evil})
    expect(page.locator(".notice .text")).to_have_text(evil)
    fake.status["reason"]["glass"] = evil
    fake.status["trial"]["target"] = evil
    expect(page.locator('[data-testid="goal-glass"] .reason')).to_have_text(evil)
    expect(page.locator("#trial .title")).to_contain_text("<img")
    fake.status["trial"].update(outcome="wrong_object", grasped=evil, phase="done")
    expect(page.locator("#outcome b")).to_contain_text("<img")
    fake.send({"type": "ended", "reason": evil})
    expect(page.locator("#lost .cap")).to_have_text(evil)
    assert page.evaluate("[window.hit, document.images.length, document.scripts.length]") == [
        None,
        0,
        1,
    ]


@pytest.mark.parametrize("junk", ["{", "[]", "null", "3", '{"type":"surprise"}', '{"type":"ack"}'])
def test_messages_that_make_no_sense_are_left_aside(
    fake: FakeServer, open_page: OpenPage, junk: str
):
    """The next status is shown as if nothing had happened."""
    page = open_page()
    for socket in list(fake._sockets):
        fake._run(socket.send_text(junk))
    fake.status["trial"]["seconds"] = 99.5
    expect(page.get_by_test_id("trial")).to_have_attribute("data-seconds", "99.5")


def test_methods_and_assistance_are_switched_and_shown(fake: FakeServer, open_page: OpenPage):
    """Pressed state comes from the robot, and the click shows at once."""
    page = open_page()
    page.get_by_test_id("method-direct").click()
    page.get_by_test_id("assist-toggle").click()
    expect(page.get_by_test_id("method-direct")).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_test_id("method-policy")).to_have_attribute("aria-pressed", "false")
    expect(page.get_by_test_id("assist-toggle")).to_have_attribute("aria-checked", "false")
    fake.wait(lambda: len(fake.commands()) == 2, "both arrive")
    assert fake.commands() == [("method", {"method": "direct"}), ("assist", {"enabled": False})]
    fake.status["trial"]["method"] = "yielding"
    expect(page.get_by_test_id("method-yielding")).to_have_attribute("aria-pressed", "true")


def test_a_refused_switch_goes_back(fake: FakeServer, open_page: OpenPage):
    """What the page shows is what the robot does."""
    fake.objections["method"] = "the method is fixed in this session"
    page = open_page()
    page.get_by_test_id("method-direct").click()
    expect(page.locator(".notice")).to_contain_text("the method is fixed in this session")
    expect(page.get_by_test_id("method-policy")).to_have_attribute("aria-pressed", "true")


def test_layers_cameras_and_the_slice(fake: FakeServer, open_page: OpenPage):
    """Each control is one change."""
    page = open_page(size=(1440, 900))
    page.get_by_test_id("layer-path").click()
    page.get_by_test_id("slice-of").select_option("glass")
    page.get_by_test_id("slice-plane").select_option("vertical")
    page.get_by_role("button", name="Side", exact=True).click()
    page.get_by_role("button", name="Reset the camera").click()
    fake.wait(lambda: len(fake.commands()) == 5, "all arrive")
    assert fake.commands() == [
        ("layers", {"changes": {"path": True}}),
        ("layers", {"changes": {"slice_of": "glass"}}),
        ("layers", {"changes": {"slice_plane": "vertical"}}),
        ("camera", {"preset": "side"}),
        ("camera", {"preset": "reset"}),
    ]
    expect(page.get_by_role("button", name="Side", exact=True)).to_have_attribute(
        "aria-pressed", "true"
    )
    expect(page.locator(".legend")).to_contain_text(re.compile("1.4.*nat.*0.2"))
    page.get_by_test_id("layer-slice").click()
    expect(page.locator(".legend")).to_be_hidden()


def test_options_of_other_methods_are_shown_but_off(fake: FakeServer, open_page: OpenPage):
    """Choices and sliders change settings; infinity is the last step of a weight."""
    page = open_page(size=(1440, 900))
    page.locator("#options").click()
    blend_only = page.get_by_test_id("setting-arbitration").get_by_role("button", name="Gate")
    expect(blend_only).to_be_disabled()
    page.get_by_test_id("setting-predictor").get_by_role("button", name="Paper").click()
    fake.wait(lambda: fake.commands(), "the choice arrives")
    page.get_by_test_id("setting-gain").fill("1.5")
    fake.wait(lambda: len(fake.commands()) == 2, "the slider arrives")
    page.keyboard.press("4")
    page.get_by_test_id("setting-w_f").fill("50")
    fake.wait(lambda: len(fake.commands()) == 4, "a weight arrives")
    page.get_by_test_id("setting-w_f").fill("205")
    fake.wait(lambda: len(fake.commands()) == 5, "infinity arrives")
    assert [fields for _, fields in fake.commands()] == [
        {"changes": {"predictor": "paper"}},
        {"changes": {"gain": 1.5}},
        {"method": "yielding"},
        {"changes": {"w_f": 50}},
        {"changes": {"w_f": "inf"}},
    ]
    expect(page.locator("#drawer p")).to_contain_text("gives way")


def test_a_scene_is_chosen_in_the_drawer(fake: FakeServer, open_page: OpenPage):
    """Another scene is another trial; new objects get their cards."""
    page = open_page()
    page.locator("#options").click()
    page.get_by_test_id("scene").select_option("clutter")
    fake.wait(lambda: fake.commands() == [("new-trial", {"scene": "clutter"})], "it is asked for")
    objects = [*fake.hello["scene"]["objects"], {"name": "tin_can", "colour": "goal-4"}]
    fake.send({**fake.hello, "scene": {"name": "clutter", "objects": objects}})
    fake.status["belief"] = {"canteen": 0.2, "block": 0.2, "glass": 0.5, "tin_can": 0.1}
    expect(page.get_by_test_id("goal-tin_can")).to_contain_text("Tin can")
    expect(page.locator("#goals")).to_have_class(re.compile("rows"))


def test_the_grasp_button_opens_a_hand_that_holds(fake: FakeServer, open_page: OpenPage):
    """Closing, then Open."""
    page = open_page()
    page.get_by_test_id("grasp").click()
    fake.wait(lambda: fake.commands() == [("grasp", {})], "it closes")
    fake.status["trial"]["phase"] = "closing"
    expect(page.locator("#grasp-label")).to_have_text("Closing")
    expect(page.get_by_test_id("grasp")).to_have_attribute("aria-disabled", "true")
    page.get_by_test_id("grasp").dispatch_event("click")  # too early: it does nothing
    fake.status["trial"].update(phase="done", outcome="grasped", grasped="glass")
    expect(page.locator("#grasp-label")).to_have_text("Open")
    page.get_by_test_id("grasp").click()
    fake.wait(lambda: len(fake.commands()) == 2, "it opens")
    assert fake.commands()[1] == ("open", {})


@pytest.mark.parametrize(
    ("outcome", "words"),
    [
        ("grasped", "Grasped the glass"),
        ("wrong_object", "Grasped the block, not the glass"),
        ("closed_on_nothing", "closed on nothing"),
        ("bad_grip", "did not hold"),
        ("knocked_over", "knocked over"),
        ("fell_off", "fell off"),
        ("timeout", "Time is up"),
        ("aborted", "ended"),
        ("interrupted", "interrupted"),
    ],
)
def test_each_outcome_has_its_words(
    fake: FakeServer, open_page: OpenPage, outcome: str, words: str
):
    """On the banner, in the live region, and in the attribute."""
    page = open_page()
    fake.status["trial"].update(outcome=outcome, phase="done", grasped="block")
    expect(page.get_by_test_id("trial")).to_have_attribute("data-outcome", outcome)
    expect(page.get_by_test_id("banner-outcome")).to_contain_text(words)
    expect(page.get_by_test_id("banner-outcome")).to_contain_text("14.2 s, input 5.8 s")
    expect(page.locator("#polite")).to_contain_text(words)
    page.get_by_test_id("outcome-action").click()
    expect(page.get_by_test_id("banner-outcome")).to_be_hidden()


def test_probabilities_are_not_announced(fake: FakeServer, open_page: OpenPage):
    """A screen reader would never fall silent."""
    page = open_page()
    expect(page.locator("#polite")).to_contain_text("Grasp the glass")
    before = page.locator("#polite").inner_text()
    fake.status["belief"] = {"canteen": 0.8, "block": 0.1, "glass": 0.1}
    expect(page.get_by_test_id("goal-canteen")).to_have_attribute("data-probability", "0.8")
    assert page.locator("#polite").inner_text() == before


def test_the_first_visit_is_coached_until_the_first_movement(fake: FakeServer, open_page: OpenPage):
    """Nothing is blocked, and it does not come back."""
    page = open_page(seen=False)
    expect(page.locator("#coach")).to_contain_text("Push a stick to start")
    expect(page.locator("#coach")).to_contain_text("Steer to the glass")
    page.evaluate("pointer('right', 'pointerdown', 0, 1)")
    expect(page.locator("#coach")).to_be_hidden()
    page.reload()
    page.wait_for_selector('[data-testid="hand"][data-x]', state="attached")
    expect(page.locator("#coach")).to_be_hidden()


def test_a_spectator_has_nothing_to_push(fake: FakeServer, open_page: OpenPage):
    """control: false; neither inputs nor commands leave the page, until control comes."""
    fake.hello["control"] = False
    page = open_page("?seed=4")
    expect(page.get_by_test_id("banner-watching")).to_be_visible()
    for name in ("stick-left", "stick-right", "grasp", "new-trial", "method-policy"):
        expect(page.get_by_test_id(name)).to_be_hidden()
    page.keyboard.press("n")
    page.keyboard.down("w")
    fake.wait(lambda: len(fake.of_type("ping")) > 1, "time passes")
    assert fake.of_type("input") == fake.of_type("command") == []
    fake.send({**fake.hello, "control": True})
    expect(page.get_by_test_id("stick-left")).to_be_visible()
    fake.wait(lambda: fake.of_type("input"), "now it steers")


def test_the_theme_is_kept_and_told(fake: FakeServer, open_page: OpenPage):
    """Page and picture change together; the choice survives a reload."""
    page = open_page()
    page.locator("#theme").click()
    assert page.evaluate("document.documentElement.dataset.theme") == "light"

    def told() -> list[str]:
        return [m["theme"] for m in fake.of_type("command") if m["name"] == "theme"]

    fake.wait(lambda: told() == ["dark", "light"], "the robot is told")
    page.reload()
    fake.wait(lambda: told() == ["dark", "light", "light"], "and again after a reload")
    assert page.evaluate("document.documentElement.dataset.theme") == "light"


def test_tags_stand_where_the_camera_sees_their_frames(fake: FakeServer, open_page: OpenPage):
    """Projected by the picture's own camera; gone with the layer, and without a picture."""
    page = open_page(size=(1000, 800))
    tag = page.locator(".tag").nth(1)
    expect(tag).to_have_text("0.19")
    # Block's frame (0.5, 0, 0.2): 0.1 m up in the picture, 1.3 m before the camera.
    up = 2 * 0.1 / 1.3
    box = tag.bounding_box()
    assert box
    assert abs(box["x"] + box["width"] / 2 - 500) < 1.5
    assert abs(box["y"] + box["height"] - 400 * (1 - up)) < 1.5
    expect(page.locator(".tag.lead")).to_have_text("0.72")
    fake.status["layers"] = {**fake.status["layers"], "tags": False}
    expect(page.locator(".tag")).to_have_count(0)
    fake.status["layers"] = {**fake.status["layers"], "tags": True}
    expect(page.locator(".tag")).to_have_count(3)
    page.evaluate("delete document.querySelector('iframe').contentWindow.__viserMutable")
    expect(page.locator(".tag:visible")).to_have_count(0)


def test_a_late_loop_is_said_on_the_page(fake: FakeServer, open_page: OpenPage):
    """With the count for who wants to know."""
    page = open_page()
    expect(page.locator(".late")).to_be_hidden()
    fake.status["loop"] = {"hz": 93.0, "late": 4, "lateness_ms": 12.5}
    expect(page.locator(".late")).to_be_visible()
    expect(page.locator(".late")).to_have_attribute("title", re.compile("4 ticks.*12.5 ms"))
    expect(page.locator(".status .hz")).to_have_text("93")


def test_the_page_asks_no_one_else_for_anything(fake: FakeServer, open_page: OpenPage):
    """No third-party requests."""
    page = open_page()
    hosts = page.evaluate(
        "performance.getEntriesByType('resource').map(e => new URL(e.name).origin)"
    )
    assert set(hosts) == {fake.url}


def test_the_page_works_without_storage(fake: FakeServer, open_page: OpenPage):
    """Browsers may forbid it."""
    page = open_page(
        seen=False,
        script="""for (const name of ['localStorage', 'sessionStorage'])
        Object.defineProperty(window, name, {get() { throw new DOMException('no'); }});""",
    )
    expect(page.get_by_test_id("connection")).to_have_attribute("data-state", "connected")
    page.locator("#theme").click()
    assert page.evaluate("document.documentElement.dataset.theme") == "light"


def test_the_history_covers_twenty_seconds_on_a_fixed_scale(open_page: OpenPage):
    """The line's points: the newest at the right edge, nothing before the window, p on 25 … 1."""
    page = open_page()
    path = page.evaluate(
        """async () => {
          const { History } = await import('/static/sparkline.js');
          const history = new History();
          for (let t = 0; t <= 30; t += 0.05) history.add(t, t < 15 ? 0 : 1);
          return history.path(30, 1, 25);
        }"""
    )
    points = [tuple(map(float, point.split())) for point in path[1:].split("L")]
    assert points[-1][0] >= 19.89 and points[-1][1] == 1.0
    assert points[0][0] == 0.0
    assert {y for _, y in points} == {1.0, 25.0}
    assert len(points) <= 202
    assert all(y == (25.0 if x < 4.94 else 1.0) for x, y in points if not 4.94 <= x <= 5.06)


def test_stored_choices_that_are_broken_are_left_aside(fake: FakeServer, open_page: OpenPage):
    """Anyone may edit their storage."""
    keys = ("theme", "follow", "coached")
    script = "".join(f"localStorage.setItem('hindsight.{key}', '{{');" for key in keys)
    page = open_page(seen=False, script=script)
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"
    assert (
        json.loads(page.evaluate("JSON.stringify([...document.querySelectorAll('.notice')])")) == []
    )
