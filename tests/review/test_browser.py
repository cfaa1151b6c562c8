# pyright: reportAttributeAccessIssue=false
"""The review as a person uses it: replay, scrub, what-if, compare, share, in a real browser."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from app.recording.reader import read_trial
from app.recording.schema import StepRecord
from app.review.notes import notes_path
from app.review.replay import Replay
from app.review.signals import distances_to_goals
from app.robot.arm import FINGER_NAMES, JOINT_NAMES
from app.robot.model import build_model
from app.robot.scene_file import load_scene
from tests.browser import chromium, open_page
from tests.review.conftest import Logs, Review, StartReview, write_broken

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]

WAIT_MS = 90_000
"""Only ends a test that would hang: software GL on a busy machine is slow."""
PLAIN = "?detail=plain"
DRAWS = """() => {
  const view = document.querySelector('[data-testid=viewer]').contentWindow.__viserMutable;
  return view?.canvas?.width > 0;
}"""
POSES = """() => {
  const poses = document.querySelector('[data-testid=viewer]').contentWindow.__viserMutable;
  return Object.fromEntries(Object.entries(poses?.nodePoseData ?? {})
    .filter(([name, pose]) => name.startsWith('/hindsight/') && pose)
    .map(([name, { wxyz, position }]) => [name, { wxyz: [...wxyz], position: [...position] }]));
}"""

LINKS = """() => JSON.stringify(
  Object.entries(window.__viserMutable?.nodePoseData ?? {})
    .filter(([name, pose]) => name.startsWith('/hindsight/arm') && pose)
    .map(([name, { wxyz, position }]) => [name, [...wxyz], [...position]]))"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A headless Chromium."""
    with chromium() as running:
        yield running


@pytest.fixture
def page(browser: Browser, review: Review) -> Iterator[Page]:
    """The review's page, drawn plainly."""
    with open_page(browser, review.url + "/review" + PLAIN) as page:
        page.set_default_timeout(WAIT_MS)
        page.wait_for_selector("[data-testid=trial-row]")
        yield page


def open_trial(page: Page, trial_id: str) -> None:
    """Click the trial's row and wait until its first step is drawn."""
    page.locator(f'[data-testid=trial-row][data-id="{trial_id}"]').click()
    page.wait_for_function(
        "id => document.getElementById('views').dataset.drawnTrial === id"
        " && document.body.dataset.trial === id",
        arg=trial_id,
    )


def wait_drawn(page: Page, step: int) -> None:
    """Wait until the worker has drawn this step."""
    page.wait_for_function(
        "step => document.getElementById('views').dataset.drawn === String(step)", arg=step
    )


def scrub(page: Page, share: float) -> int:
    """Press on the timeline at a share of its length; returns the step it stands at."""
    box = page.get_by_test_id("timeline").bounding_box()
    assert box
    page.mouse.click(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
    return int(page.get_by_test_id("timeline").get_attribute("data-step") or -1)


def arm_in_world(poses: dict[str, Any], node: str) -> np.ndarray:
    """Where a node stands in the world, through all its parents' poses [m]."""
    place = np.zeros(3)
    while node and node != "/hindsight":
        pose = poses.get(node, {"wxyz": [1, 0, 0, 0], "position": [0, 0, 0]})
        turned = np.empty(3)
        mujoco.mju_rotVecQuat(turned, place, np.array(pose["wxyz"], dtype=float))
        place = turned + np.array(pose["position"])
        node = node.rpartition("/")[0]
    return place


def logged_bodies(record: StepRecord) -> dict[str, np.ndarray]:
    """Where the bodies of the arm stood [m], by MuJoCo from the logged joints."""
    model = build_model(load_scene("default"))
    data = mujoco.MjData(model)
    for name, angle in zip(JOINT_NAMES, record.joint_positions_rad, strict=True):
        data.joint(name).qpos[0] = angle
    for name, travel in zip(FINGER_NAMES, record.finger_positions_m, strict=True):
        data.joint(name).qpos[0] = travel
    mujoco.mj_kinematics(model, data)
    return {model.body(i).name: data.xpos[i].copy() for i in range(model.nbody)}


@pytest.mark.slow
def test_a_scrubbed_moment_is_the_logs(page: Page, logs: Logs):
    """Timeline, clock and picture stand at the same step; the arm is where it was, to 1e-3 m."""
    open_trial(page, logs.glass)
    replay = Replay(read_trial(logs.path(logs.glass)))
    for share in (0.7, 0.25, 0.55):
        step = scrub(page, share)
        assert step == pytest.approx(share * (replay.n_steps - 1), abs=3)
        wait_drawn(page, step)
        record = replay.record(step)
        shown = float(page.get_by_test_id("timeline").get_attribute("data-seconds") or "nan")
        assert shown == pytest.approx(record.time_s, abs=1e-3)
        want = logged_bodies(record)

        def matches(want: dict[str, np.ndarray] = want) -> bool:
            poses = page.evaluate(POSES)
            nodes = [n for n in poses if n.startswith("/hindsight/arm/") and leaf(n) in want]
            return len(nodes) >= 7 and all(
                np.abs(arm_in_world(poses, node) - want[leaf(node)]).max() < 1e-3 for node in nodes
            )

        until(page, matches)
    assert page.locator("[data-testid=signals] .playhead").count() > 0


def leaf(node: str) -> str:
    """The last part of a node's name."""
    return node.rpartition("/")[2]


def until(page: Page, condition: Callable[[], bool]) -> None:
    """Wait for something that takes a frame or two to arrive."""
    for _ in range(WAIT_MS // 50):
        if condition():
            return
        page.wait_for_timeout(50)
    raise AssertionError("it did not happen")


def test_a_trial_plays_pauses_and_jumps(page: Page, logs: Logs):
    """Play moves time and picture, speed scales it, keys step by ticks, marks are jumped to."""
    open_trial(page, logs.glass)
    timeline, play = page.get_by_test_id("timeline"), page.get_by_test_id("play")
    page.get_by_test_id("speed").select_option("0.5")
    start = int(timeline.get_attribute("data-step") or 0)
    play.click()
    assert play.get_attribute("aria-pressed") == "true"
    page.wait_for_function(
        "start => Number(document.getElementById('timeline').dataset.step) > start + 10", arg=start
    )
    play.click()
    paused = int(timeline.get_attribute("data-step") or 0)
    wait_drawn(page, paused)
    timeline.focus()
    page.keyboard.press("ArrowRight")
    assert timeline.get_attribute("data-step") == str(paused + 1)
    page.keyboard.press("Shift+ArrowLeft")
    assert timeline.get_attribute("data-step") == str(paused - 9)
    page.keyboard.press("End")
    last = read_trial(logs.path(logs.glass)).n_steps - 1
    assert timeline.get_attribute("data-step") == str(last)
    page.keyboard.press("Home")
    page.keyboard.press("]")
    first = page.locator("#marks button").first
    assert timeline.get_attribute("data-step") == first.get_attribute("data-step")
    page.get_by_test_id("speed").select_option("8")
    play.click()
    page.wait_for_selector("[data-testid=play][aria-pressed=false]")
    assert timeline.get_attribute("data-step") == str(last)


@pytest.mark.slow
def test_a_click_into_a_curve_goes_there(page: Page, logs: Logs):
    """The plots seek on click, zoom by drag, and come back on a double click."""
    open_trial(page, logs.glass)
    over = page.locator("[data-key=twist-0] .u-over")
    over.wait_for()
    box = over.bounding_box()
    assert box
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 30)
    n_steps = read_trial(logs.path(logs.glass)).n_steps
    step = int(page.get_by_test_id("timeline").get_attribute("data-step") or 0)
    assert step == pytest.approx(0.5 * n_steps, abs=0.02 * n_steps)
    value = page.locator("[data-key=twist-0] header .num").inner_text()
    assert value.endswith("m/s") and value != "–"
    page.mouse.move(box["x"] + 0.2 * box["width"], box["y"] + 30)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 35, steps=4)
    page.mouse.up()
    middle = 0.3 * n_steps
    until(page, lambda: abs(click_middle(page) - middle) < 0.03 * n_steps)


def click_middle(page: Page) -> int:
    """Click into the middle of the first plot; the step it leads to."""
    box = page.locator("[data-key=twist-0] .u-over").bounding_box()
    assert box
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 30)
    return int(page.get_by_test_id("timeline").get_attribute("data-step") or 0)


@pytest.mark.slow
def test_what_would_have_been(page: Page, logs: Logs):
    """Another method is drawn against what was done; from a moment on it says its caveat."""
    open_trial(page, logs.block)
    page.locator("#marks button", has_text="hand closes").click()
    page.keyboard.press("PageDown")
    page.get_by_test_id("what-if").click()
    page.locator("#what-if-panel [data-setting=method]").select_option("direct")
    page.get_by_test_id("what-if-open").click()
    now = page.get_by_test_id("what-if-now")
    now.wait_for()
    assert float(now.get_attribute("data-assistance") or "nan") == 0.0
    assert "instead of" in now.inner_text()
    legend = page.locator("[data-key=twist-0] .legend").inner_text()
    assert "direct" in legend
    moment = page.get_by_test_id("what-if-moment")
    moment.locator("tr[data-method=policy]").wait_for()
    page.get_by_test_id("what-if-closed").click()
    page.wait_for_selector(".answer[data-loop=closed]")
    answer = page.get_by_test_id("what-if-result").inner_text()
    assert "a person would have reacted" in answer and "leaves the log" not in answer


@pytest.mark.slow
def test_trials_side_by_side(page: Page, logs: Logs):
    """Two trials move together: by time, by an event, by the distance to the goal."""
    for trial_id in (logs.glass, logs.block):
        page.locator(f'[data-testid=trial-row][data-id="{trial_id}"] input').check()
    page.get_by_test_id("compare").click()
    page.wait_for_selector("[data-testid=viewer-1]")
    replays = [Replay(read_trial(logs.path(name))) for name in (logs.glass, logs.block)]
    by = page.get_by_test_id("compare-by")
    by.wait_for()
    closes = [int(np.flatnonzero(r.log.steps["phase"] == "closing")[0]) for r in replays]

    def steps() -> list[int]:
        text = page.evaluate("document.getElementById('views').dataset.steps")
        return [int(part) for part in text.split(",")]

    page.locator("#marks button", has_text="hand closes").click()
    assert steps() == [closes[0], closes[0]]  # both started at the same tick
    by.select_option("event: hand closes")
    assert steps() == closes
    by.select_option("distance")
    scrub(page, 0.3)
    mine, other = steps()
    left = [nearest_so_far(replay) for replay in replays]
    assert left[1][other] <= left[0][mine] + 1e-5 or other == replays[1].n_steps - 1
    assert other == 0 or left[1][other - 1] > left[0][mine] - 1e-5
    page.wait_for_function(
        "() => document.querySelectorAll('[data-key^=compare-] canvas').length >= 3"
    )


def nearest_so_far(replay: Replay) -> np.ndarray:
    """The least distance to the instructed goal up to each step [m], (n_steps,)."""
    goal = replay.header.goal_names.index(replay.header.instructed_goal)
    return np.minimum.accumulate(distances_to_goals(replay)[:, goal])


@pytest.mark.slow
def test_a_trial_is_shared(page: Page, logs: Logs, browser: Browser, tmp_path: Path):
    """One HTML file that plays from disk, a PNG, and a link that leads to the same moment."""
    open_trial(page, logs.glass)
    step = scrub(page, 0.5)
    wait_drawn(page, step)
    page.get_by_test_id("share").click()
    page.get_by_test_id("share-link").click()
    url = page.get_by_test_id("share-url")
    until(page, lambda: url.input_value() != "")
    until(page, lambda: page.evaluate(DRAWS))
    with page.expect_download(timeout=WAIT_MS) as saved:
        page.get_by_test_id("share-png").click()
    picture = tmp_path / "view.png"
    saved.value.save_as(picture)
    assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size > 2000
    with page.expect_download(timeout=WAIT_MS) as saved:
        page.get_by_test_id("share-html").click()
    html = tmp_path / "trial.html"
    saved.value.save_as(html)
    assert html.stat().st_size > 100_000
    with open_page(browser, html.as_uri(), (480, 320)) as alone:
        alone.wait_for_selector("canvas", timeout=WAIT_MS)
        assert "http://" not in alone.url
        # It plays by itself: the arm's links are elsewhere a moment later.
        alone.wait_for_function(f"() => ({LINKS})().length > 50", timeout=WAIT_MS)
        first = alone.evaluate(LINKS)
        alone.wait_for_function(f"first => ({LINKS})() !== first", arg=first, timeout=WAIT_MS)
        assert alone.evaluate("getComputedStyle(document.querySelector('canvas')).opacity") == "1"
        alone.screenshot(path=tmp_path / "alone.png")
    link = url.input_value().replace("/review#", f"/review{PLAIN}#")
    with open_page(browser, link) as there:
        there.set_default_timeout(WAIT_MS)
        there.wait_for_function(
            "step => document.getElementById('views').dataset.drawn === String(step)", arg=step
        )


@pytest.mark.slow
def test_a_film_is_recorded(page: Page, logs: Logs, tmp_path: Path):
    """WebM of the view while the trial plays to its end."""
    open_trial(page, logs.glass)
    scrub(page, 0.8)
    page.wait_for_selector("[data-testid=viewer]")
    until(page, lambda: page.evaluate(DRAWS))
    page.get_by_test_id("share").click()
    with page.expect_download(timeout=WAIT_MS) as saved:
        page.get_by_test_id("share-webm").click()
    film = tmp_path / "view.webm"
    saved.value.save_as(film)
    assert film.stat().st_size > 500
    assert film.read_bytes()[:4] == b"\x1aE\xdf\xa3"


def test_flag_note_filter_and_sort(copied: Logs, review_of: StartReview, browser: Browser):
    """A flag and a note are kept beside the log; the table finds them, and sorts by input."""
    review = review_of(copied.root)
    with open_page(browser, review.url + "/review" + PLAIN) as page:
        page.set_default_timeout(WAIT_MS)
        page.wait_for_selector("[data-testid=trial-row]")
        open_trial(page, copied.glass)
        page.keyboard.press("f")
        row = page.locator(f'[data-testid=trial-row][data-id="{copied.glass}"]')
        page.wait_for_selector(f'[data-id="{copied.glass}"][data-flag=true]')
        page.locator("#notes-open").click()
        page.get_by_label("Note on this trial").fill("reaches twice")
        page.get_by_label("Annotate this moment").fill("here")
        page.keyboard.press("Enter")
        page.wait_for_selector("#notes li")
        kept = json.loads(notes_path(copied.path(copied.glass)).read_text())
        assert kept["flag"] and kept["moments"][0]["text"] == "here"
        page.locator("#filter-flagged").click()
        rows = page.get_by_test_id("trial-row")
        until(page, lambda: rows.count() == 1)
        assert row.is_visible()
        page.locator("#filter-all").click()
        until(page, lambda: rows.count() == 3)
        page.locator("#search").fill("canteen direct")
        until(page, lambda: rows.count() == 1)
        assert rows.first.get_attribute("data-id") == copied.canteen
        page.locator("#filter-all").click()
        page.locator("#heads button", has_text="Input s").click()
        inputs = [float(rows.nth(i).locator("td").nth(7).inner_text() or "nan") for i in range(3)]
        assert inputs == sorted(inputs, reverse=True)


@pytest.mark.slow
def test_damaged_logs_are_listed_with_what_is_wrong(
    copied: Logs, review_of: StartReview, browser: Browser
):
    """Each row says it in words, opens nothing when clicked, and leaves the others usable."""
    broken = write_broken(copied)
    review = review_of(copied.root)
    with open_page(browser, review.url + "/review" + PLAIN) as page:
        page.set_default_timeout(WAIT_MS)
        rows = page.get_by_test_id("trial-row")
        until(page, lambda: rows.count() == 3 + len(broken))
        for trial_id, problem in broken.items():
            row = page.locator(f'[data-testid=trial-row][data-id="{trial_id}"]')
            assert problem in row.inner_text() and row.get_attribute("aria-disabled") == "true"
            row.dispatch_event("click")
            assert problem in page.locator("#messages [role=alert]").inner_text()
        assert page.evaluate("document.body.dataset.trial ?? ''") == ""
        open_trial(page, copied.glass)


@pytest.mark.slow
def test_without_the_plotting_library_the_page_says_how_to_get_it(
    logs: Logs, browser: Browser, review: Review
):
    """No plots, but everything else works, and one sentence says what to type."""
    context = browser.new_context(viewport={"width": 1024, "height": 640})
    bare = context.new_page()
    bare.set_default_timeout(WAIT_MS)
    bare.route("**/vendor/**", lambda route: route.fulfill(status=404, body="gone"))
    bare.goto(review.url + "/review" + PLAIN)
    bare.wait_for_selector("[data-testid=trial-row]")
    open_trial(bare, logs.glass)
    assert "make plots" in bare.locator("#signals .missing").inner_text()
    wait_drawn(bare, scrub(bare, 0.4))
    context.close()
