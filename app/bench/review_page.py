"""The review in a browser: from a click on a row to its first step, from a scrub to the arm's pose.

Each recorded tick carries its number into the view's hidden frame `/probe`, in the same atomic
block as the poses of the arm: when it has arrived, so has the right frame.
"""

import sys
from importlib.util import find_spec
from typing import Any

import numpy as np

from app.browser import HEADLESS_FLAGS, find_browser

N_SCRUBS = 150
N_OPENED = 8
# Moves over the timeline as a dragging finger does, and looks at the scene in each frame.
SCRUB = """
async (moves) => {
  const frame = () => new Promise(requestAnimationFrame);
  const line = document.querySelector('[data-testid=timeline]');
  const view = document.querySelector('[data-testid=viewer]').contentWindow;
  const drawn = () => view.__viserMutable?.nodePoseData?.['/probe']?.position?.[0] ?? -1;
  const box = line.getBoundingClientRect();
  line.setPointerCapture = () => {};
  line.hasPointerCapture = () => true;
  const point = (kind, share) => line.dispatchEvent(new PointerEvent(kind, {bubbles: true,
    isPrimary: true, pointerId: 7, clientX: box.x + share * box.width, clientY: box.y + 10,
    buttons: 1}));
  point('pointerdown', 0.5);
  const taken = [];
  for (let i = 0; i < moves; i++) {
    for (let wait = 3 + (i * 7) % 5; wait > 0; wait--) await frame();
    const start = performance.now();
    point('pointermove', (0.5 + i * 0.382) % 1);
    const step = Number(line.dataset.step);
    while (drawn() !== step && performance.now() - start < 5000) await frame();
    taken.push(performance.now() - start);
  }
  return taken;
}
"""
OPEN = """
async (id) => {
  const start = performance.now();
  document.querySelector(`[data-testid=trial-row][data-id="${id}"]`).click();
  const views = document.getElementById('views');
  while (views.dataset.drawnTrial !== id || document.body.dataset.trial !== id) {
    await new Promise((done) => setTimeout(done, 5));
  }
  return (performance.now() - start) / 1000;
}
"""
DRAWN = """() => document.querySelector('[data-testid=viewer]')
  .contentWindow.__viserMutable?.nodePoseData?.['/probe']"""


def bench_page(url: str, trials: list[str], n_scrubs: int = N_SCRUBS) -> dict[str, dict[str, Any]]:
    """Names → {median, p95, p99, unit}: page_open [s], page_scrub [ms].

    Empty, with a reason, where there is no browser. Without a graphics card the page leaves out
    shadows and floor by itself, as it does for everybody.

    Args:
        url: Of the review.
        trials: Ids of trials whose caches are there, of the same length.
        n_scrubs: How many moments are gone to.
    """
    browser = find_browser()
    if browser is None or find_spec("playwright") is None:
        print("page: left out, no Chromium or no playwright here", file=sys.stderr)
        return {}
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=browser, args=list(HEADLESS_FLAGS))
        try:
            page = running.new_page(viewport={"width": 1024, "height": 640})
            page.set_default_timeout(120_000)
            page.goto(f"{url}/review")
            page.wait_for_selector("[data-testid=trial-row]")
            page.wait_for_selector("body[data-connection=connected]")
            opened = [page.evaluate(OPEN, trial) for trial in trials[: N_OPENED + 1]][1:]
            page.wait_for_function(DRAWN)
            page.wait_for_timeout(2000)
            taken = page.evaluate(SCRUB, n_scrubs)
        finally:
            running.close()
    return {"page_open": _figure(opened, "s"), "page_scrub": _figure(taken, "ms")}


def _figure(values: list[float], unit: str) -> dict[str, Any]:
    median, p95, p99 = (round(float(v), 3) for v in np.percentile(values, [50, 95, 99]))
    return {"median": median, "p95": p95, "p99": p99, "unit": unit}
