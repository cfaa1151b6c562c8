"""The browser on this machine, and who draws in it: a graphics card or the processor."""

import os
import re
import subprocess
import tempfile
from pathlib import Path

from app.browser import find_browser
from app.doctor.finding import Finding

TIMEOUT_S = 60
SOFTWARE = ("swiftshader", "llvmpipe", "softpipe", "software")
PROBE = """<!doctype html><p id="found">?</p><script>
const gl = document.createElement('canvas').getContext('webgl2');
const more = gl?.getExtension('WEBGL_debug_renderer_info');
const name = gl ? gl.getParameter(more ? more.UNMASKED_RENDERER_WEBGL : gl.RENDERER) : 'nothing';
document.querySelector('#found').textContent = '[' + name + ']';
</script>"""


def check_browser() -> Finding:
    """Whether a Chromium is here, and how it would draw the robot."""
    path = find_browser()
    if path is None:
        text = "no Chromium or Chrome found on this machine"
        advice = "any browser elsewhere does; `make browser` installs one for tests and benches"
        return Finding("Browser", "warn", text, advice)
    try:
        return judge_renderer(path, find_renderer(path))
    except (OSError, subprocess.SubprocessError) as error:
        return Finding("Browser", "warn", f"{path} does not run: {error}", "reinstall it")


def judge_renderer(path: str, renderer: str | None) -> Finding:
    """What a browser's WebGL renderer means for the picture."""
    if renderer is None:
        return Finding("Browser", "warn", f"{path} shows no page", "reinstall it")
    if renderer == "nothing":
        advice = "switch hardware acceleration on in its settings, or use another browser"
        return Finding("Browser", "warn", f"{path} draws no WebGL: there is no picture", advice)
    if any(name in renderer.lower() for name in SOFTWARE):
        text = f"{path} draws in software here ({renderer})"
        advice = "show the page on a machine with a graphics card: the picture moves smoothly there"
        return Finding("Browser", "warn", text, advice)
    return Finding("Browser", "ok", f"{path}, drawn by {renderer}")


def find_renderer(path: str) -> str | None:
    """What draws WebGL in this browser; None where it shows no page at all.

    Raises:
        OSError, subprocess.SubprocessError: If it cannot be run.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        page = Path(folder) / "probe.html"
        page.write_text(PROBE, encoding="utf-8")
        command = [path, "--headless", f"--user-data-dir={folder}/profile", "--no-first-run"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            command.append("--no-sandbox")  # Chromium refuses to be run by root with it
        done = subprocess.run(
            [*command, "--dump-dom", page.as_uri()],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=TIMEOUT_S,
            check=False,
        )
    found = re.search(r'<p id="found">\[(.*?)\]</p>', done.stdout, re.DOTALL)
    return found[1] if found else None
