"""The participant's page in a real browser: a whole participation by sticks, from link to code."""

import csv
import re

import pytest

from tests.browser import chromium, open_page
from tests.study.person import go_on, step_of, take_part
from tests.study.server import StudyServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(900)]


@pytest.mark.slow
def test_a_participant_from_link_to_code(server: StudyServer):
    """Sticks and all; the link's parameters are gone from the address, the tables are right."""
    with chromium() as browser:
        with open_page(browser, f"{server.url}/?fast=1&PROLIFIC_PID=page") as page:
            assert page.url == f"{server.url}/"
            seen = take_part(page)
            code = page.get_by_test_id("completion-code").text_content()
            withdrawal = page.get_by_test_id("withdrawal-code").text_content()
    assert code and withdrawal and re.fullmatch(r"\w{4}-\w{4}-\w{4}", withdrawal)
    kinds = [name.partition(":")[0] for name in seen]
    assert kinds[:4] == ["consent", "background", "device", "instructions"]
    assert kinds[-3:] == ["survey", "debrief", "done"]
    assert seen.count("trial:grasped") == 6
    path = server.sessions / "paper" / "data" / "study-paper_description-trials_data.csv"
    with path.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["counted"] == "true"]
    assert len(rows) >= 6 and {row["device"] for row in rows} == {"pointer"}


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
