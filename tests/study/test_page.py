"""The participant's page in a real browser: a whole participation by sticks, from link to code."""

import csv
import json
import re
from pathlib import Path

import pytest

from app.recording.reader import read_trial
from app.study.visitor import Visitor
from tests.browser import chromium, open_page
from tests.study.person import go_on, step_of, take_part
from tests.study.server import StudyServer
from tests.study.traffic import Traffic

FOCUSED = "() => document.activeElement.name || document.activeElement.dataset.testid"
pytestmark = [pytest.mark.browser, pytest.mark.timeout(900)]


@pytest.mark.slow
def test_participants_from_link_to_code_in_both_orders(server: StudyServer):
    """Sticks and all; no parameter stays in the address, no method's name reaches the page."""
    ends = []
    with chromium() as browser:
        for name in ("first", "second"):
            with open_page(browser, "about:blank") as page:
                traffic = Traffic(page)
                page.goto(f"{server.url}/?fast=1&PROLIFIC_PID={name}")
                assert page.url == f"{server.url}/"
                seen = take_part(page, shots=traffic.collect)
                traffic.collect()
                code = page.get_by_test_id("completion-code").text_content()
                withdrawal = page.get_by_test_id("withdrawal-code").text_content()
            assert code and withdrawal and re.fullmatch(r"\w{4}-\w{4}-\w{4}", withdrawal)
            assert traffic.naming_a_method() == []
            assert traffic.count("/input/") > 1000 and traffic.count("/view/") > 1000
            assert traffic.count("/static/") > 15 and traffic.count("/api/study") > 15
            ends.append((code, seen))
    for _, seen in ends:
        kinds = [name.partition(":")[0] for name in seen]
        assert kinds[:4] == ["consent", "background", "device", "instructions"]
        assert kinds[-3:] == ["survey", "debrief", "done"]
        assert seen.count("trial:grasped") == 6
    done = [row for row in table(server, "participants") if row["status"] == "completed"]
    assert sorted(row["order"] for row in done) == ["blend>policy", "policy>blend"]
    rows, answers = table(server, "trials"), table(server, "survey")
    for person, (_, seen) in zip(done, ends, strict=True):
        order = person["order"].split(">")
        mine = [row for row in rows if row["participant_id"] == person["participant_id"]]
        told = [name for name in seen if name.startswith(("training:", "trial:"))]
        noted = [("trial" if r["part"] == "recorded" else "training", r["outcome"]) for r in mine]
        assert [f"{part}:{outcome}" for part, outcome in noted] == told
        assert [r["method"] for r in mine if r["counted"] == "true"] == [
            method for method in order for _ in range(3)
        ]
        assert all(r["shown_as"] == f"method{1 + order.index(r['method'])}" for r in mine)
        assert all(r["device"] == "pointer" and float(r["input_s"]) > 0 for r in mine)
        said = {
            (r["shown_as"], r["item"]): int(r["value"])
            for r in answers
            if r["participant_id"] == person["participant_id"]
        }
        items = ("control", "wanted", "quickly", "like")
        expected = {(f"method{k}", item): 6 for k in (1, 2) for item in items}
        assert said == {**expected, ("", "prefer"): 6 if order[0] == "blend" else 2}


@pytest.mark.slow
def test_full_screen_and_slow_pictures_are_in_the_trials_log(server: StudyServer):
    """What a participant's screen did meanwhile stands beside what the participant did."""
    slow_down = """() => {
      const draw = window.requestAnimationFrame;
      window.requestAnimationFrame = (step) => setTimeout(() => draw(step), 200);
      setTimeout(() => { window.requestAnimationFrame = draw; }, 4000);
    }"""
    before = set(server.sessions.rglob("*.mcap"))
    with chromium() as browser, open_page(browser, f"{server.url}/?fast=1") as page:
        take_part(page, until=("training",))
        page.wait_for_function(
            "() => document.querySelector('[data-testid=trial]').dataset.outcome === 'running'",
            timeout=90_000,
        )
        for change in ("documentElement.requestFullscreen", "exitFullscreen"):
            page.evaluate(
                f"""() => new Promise((done) => {{
                  document.addEventListener('fullscreenchange', done, {{ once: true }});
                  document.{change}();
                }})"""
            )
        page.evaluate(slow_down)
        page.wait_for_timeout(5000)
        page.reload()  # the trial is interrupted, its log closed
        while not (logs := set(server.sessions.rglob("*.mcap")) - before):
            page.wait_for_timeout(200)
    (log,) = logs
    names = [event.name for event in read_trial(log).events]
    assert {"fullscreen", "windowed", "frames_low"} <= set(names)


def table(server: StudyServer, what: str) -> list[dict[str, str]]:
    """A table of the study."""
    path = server.sessions / "paper" / "data" / f"study-paper_description-{what}_data.csv"
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_pages_keep_what_was_answered_and_take_only_what_is_complete(server: StudyServer):
    """Nothing preselected; consent is active; a reload loses no answer; leaving is one click."""
    with chromium() as browser:
        with open_page(browser, f"{server.url}/?fast=1", (780, 360)) as page:
            agree = page.get_by_test_id("consent-agree")
            assert not agree.is_checked()
            page.get_by_test_id("continue").dispatch_event("click")
            assert step_of(page) == "consent"
            agree.check()
            go_on(page)
            assert page.locator("input:checked").count() == 0
            reached = []
            for _ in range(4):
                page.keyboard.press("Tab")
                reached.append(page.evaluate(FOCUSED))
            assert reached == ["gender", "experience", "prior_exposure", "continue"]
            with page.expect_response("**/api/study"):
                page.locator('input[name="gender"][value="other"]').check()
            page.get_by_test_id("continue").dispatch_event("click")
            assert page.locator(".row.bad").count() == 2
            page.reload()
            page.wait_for_selector('input[name="gender"][value="other"]:checked')
            for name, value in (("experience", "some"), ("prior_exposure", "no")):
                page.locator(f'input[name="{name}"][value="{value}"]').focus()
                page.keyboard.press("Space")
            go_on(page)
            assert step_of(page) == "device"
            page.get_by_test_id("withdraw").click()
            page.wait_for_selector('[data-step="withdrawn"]')
            assert page.get_by_test_id("erased").locator("li").count() >= 4
            page.reload()
            page.wait_for_selector('[data-step="withdrawn"]')


@pytest.mark.slow
def test_who_comes_when_all_places_are_taken_waits_kindly_and_gets_in(tmp_path: Path):
    """One place: the page says so in words, and the robot appears when the other one leaves."""
    running = StudyServer(tmp_path, options=("--test-run", "--capacity", "1"))
    try:
        running.start()
        first, second = (Visitor(running.url, f"browser-00000000{n}") for n in ("one1", "two2"))
        for person in (first, second):
            person.arrive("?fast=1")
            while (state := person.state())["step"] != "training":
                person.do_step(state)
        with first.dial(first.state()["trial"]["session"]) as socket, chromium() as browser:
            while json.loads(socket.recv(120))["type"] != "status":
                pass
            with open_page(browser, "about:blank", (640, 400)) as page:
                page.context.add_cookies(
                    [{"name": k, "value": v, "url": running.url} for k, v in second.cookies.items()]
                )
                page.goto(running.url)
                card = page.locator("#say .card")
                page.wait_for_function(
                    "() => document.querySelector('#say .card b')?.textContent.includes('wait')",
                    timeout=60_000,
                )
                said = card.text_content() or ""
                assert "All robots are in use" in said and "goes on by itself" in said
                link = page.get_by_test_id("connection")
                assert link.get_attribute("data-state") == "reconnecting"
                assert step_of(page) == "training"
                first.want(do="withdraw")
                page.wait_for_function(
                    "() => document.querySelector('[data-testid=connection]').dataset.state"
                    " === 'connected' && document.querySelector('[data-testid=hand]').dataset.x",
                    timeout=120_000,
                )
    finally:
        running.stop()
