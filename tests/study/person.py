"""A person who takes part in a study by the browser: reads each page, steers by eye, answers."""

from pathlib import Path
from typing import Any

from playwright.sync_api import Page

DRIVER = (Path(__file__).parent.parent / "e2e" / "driver.js").read_text()
ENDS = ("done", "withdrawn")


def step_of(page: Page) -> str:
    """The step the page shows."""
    return page.get_by_test_id("step").get_attribute("data-step") or ""


def key_of(page: Page) -> str:
    """What changes when the page goes on."""
    step = page.get_by_test_id("step")
    shown = str(page.locator("#stage").is_visible()).lower()
    return f"{step.get_attribute('data-step')}/{step.get_attribute('data-page')}/{shown}"


def go_on(page: Page) -> None:
    """Press Continue, and wait until another page is there."""
    before = key_of(page)
    page.get_by_test_id("continue").click()
    page.wait_for_function(
        "before => { const s = document.querySelector('[data-testid=step]');"
        " return `${s.dataset.step}/${s.dataset.page}/${!document.getElementById('stage').hidden}`"
        " !== before; }",
        arg=before,
        timeout=60_000,
    )


def answer_all(page: Page, pick: int = 0) -> None:
    """Choose the radio at this place in every group."""
    page.evaluate(
        """pick => { for (const group of document.querySelectorAll('[role=radiogroup]')) {
          const radios = [...group.querySelectorAll('input[type=radio]')];
          radios[Math.min(pick, radios.length - 1)].click(); } }""",
        pick,
    )


def do_trial(page: Page) -> str:
    """Wait for the start signal, grasp the named object, and return the outcome."""
    page.evaluate(DRIVER)
    page.wait_for_selector(
        '[data-testid="connection"][data-state="connected"]', state="attached", timeout=90_000
    )
    page.wait_for_function(
        "() => document.querySelector('[data-testid=hand]').dataset.x !== undefined"
        " && document.querySelector('[data-testid=trial]').dataset.outcome === 'running'",
        timeout=90_000,
    )
    target = page.get_by_test_id("trial").get_attribute("data-target") or ""
    return page.evaluate("name => driver.grasp(name, {seconds: 120})", target)


def take_part(page: Page, shots: Any = None, until: tuple[str, ...] = ENDS) -> list[str]:
    """Go through the study until one of these steps; returns the steps and outcomes."""
    seen: list[str] = []
    while True:
        page.wait_for_selector('[data-testid="step"]:not([data-step=""])', timeout=60_000)
        step = step_of(page)
        if shots is not None:
            shots(page, f"{len(seen):02d}-{step}")
        if step in until:
            return [*seen, step]
        seen.append(step)
        if page.locator("#stage").is_visible():
            seen[-1] += ":" + do_trial(page)
            page.wait_for_function(
                """before => document.getElementById('stage').hidden
                  || document.querySelector('[data-testid=trial]').dataset.outcome === 'running'""",
                timeout=90_000,
            )
            continue
        if step == "consent":
            page.get_by_test_id("consent-agree").check()
        elif step in ("background", "survey"):
            answer_all(page, 0 if step == "background" else 5)
            if step == "survey":
                page.get_by_test_id("comments").fill("Both were fine.")
        elif step == "device":
            page.wait_for_selector('[data-testid="continue"]:not([aria-disabled="true"])')
        go_on(page)
