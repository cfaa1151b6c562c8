"""From a pointer event on the stick to the pose in a browser's frame, over loopback.

Inputs are numbered; the worker puts the number of the newest into the hidden frame `/probe`, in
the same atomic block as the arm's poses; the page looks at it in each animation frame.
"""

import subprocess
import sys
import tempfile
from importlib.util import find_spec
from typing import Any

import numpy as np

from app.browser import HEADLESS_FLAGS, find_browser

N_MOVES = 150
# Notes the sequence number of every input message as it leaves the page.
WATCH_SOCKET = """
const send = WebSocket.prototype.send;
window.sent = [];
WebSocket.prototype.send = function (data) {
  if (typeof data === 'string') {
    const message = JSON.parse(data);
    if (message.type === 'input') window.sent.push([message.seq, performance.now(), message.right]);
  }
  return send.call(this, data);
};
"""
UNTIL_DRAWN = """
async () => {
  const view = document.querySelector('[data-testid="viewer"]');
  while (!view.contentWindow?.__viserMutable?.nodePoseData?.['/probe']) {
    await new Promise((done) => setTimeout(done, 100));
  }
}
"""
MEASURE = """
async (moves) => {
  const frame = () => new Promise(requestAnimationFrame);
  const stick = document.querySelector('[data-testid="stick-right"]');
  const box = stick.getBoundingClientRect();
  const [cx, cy] = [box.x + box.width / 2, box.y + box.height / 2];
  const point = (kind, x, y) => stick.dispatchEvent(new PointerEvent(kind, {bubbles: true,
    isPrimary: true, pointerType: 'touch', pointerId: 7, clientX: cx + x, clientY: cy + y,
    buttons: kind === 'pointerup' ? 0 : 1}));
  const probe = () => document.querySelector('[data-testid="viewer"]')
    .contentWindow.__viserMutable?.nodePoseData?.['/probe']?.position?.[0] ?? -1;
  const latencies = [];
  const frames = [];
  let last = 0;
  const each = (now) => {
    if (last) frames.push(now - last);
    last = now;
    requestAnimationFrame(each);
  };
  requestAnimationFrame(each);
  point('pointerdown', 0, 0);
  for (let i = 0; i < moves; i++) {
    for (let wait = 3 + (i * 7) % 5; wait > 0; wait--) await frame();
    const start = performance.now();
    const before = window.sent.length;
    const angle = i * 2.4;
    point('pointermove', 20 * Math.cos(angle), 20 * Math.sin(angle));
    let sequence = null;
    while (performance.now() - start < 2000) {
      if (sequence === null && window.sent.length > before) sequence = window.sent[before][0];
      if (sequence !== null && probe() >= sequence) {
        latencies.push(performance.now() - start);
        break;
      }
      await frame();
    }
  }
  point('pointerup', 0, 0);
  return [latencies, frames];
}
"""


def bench_latency() -> dict[str, dict[str, Any]]:
    """Latency, and the time between two frames of the page, which most of it is, [ms].

    Empty, with a reason, where no browser is found.
    """
    browser = find_browser()
    if browser is None or find_spec("playwright") is None:
        print("latency: left out, no Chromium or no playwright here", file=sys.stderr)
        return {}
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder:
        server = subprocess.Popen(
            [sys.executable, "-u", "-m", "app", "run", "--port", "0", "--sessions", folder],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        try:
            url = _read_address(server)
            with sync_playwright() as playwright:
                page = playwright.chromium.launch(
                    executable_path=browser, args=list(HEADLESS_FLAGS)
                ).new_page(viewport={"width": 640, "height": 400})
                page.add_init_script(WATCH_SOCKET)
                page.goto(f"{url}/?method=direct")
                page.wait_for_selector('[data-testid="connection"][data-state="connected"]')
                page.evaluate(UNTIL_DRAWN)
                page.wait_for_timeout(2000)
                latencies, frames = page.evaluate(MEASURE, N_MOVES)
        finally:
            server.terminate()
            server.wait(30)
    if len(latencies) < N_MOVES // 2:
        print(f"latency: only {len(latencies)} of {N_MOVES} moves were seen", file=sys.stderr)
    measured = {"latency": latencies, "frame": frames}
    return {
        name: {"median": float(np.median(ms)), "p99": float(np.percentile(ms, 99)), "unit": "ms"}
        for name, ms in measured.items()
    }


def _read_address(server: "subprocess.Popen[str]") -> str:
    assert server.stdout is not None
    for line in server.stdout:
        for word in line.split():
            if word.startswith("http://"):
                return word.rstrip("/.,")
    raise RuntimeError("the server ended before it named its address")
