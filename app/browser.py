"""Finding a Chromium on this machine, and the flags that run it headless with software GL."""

import os
import shutil

BROWSER_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
HEADLESS_FLAGS = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


def find_browser() -> str | None:
    """Path of an installed Chromium or Chrome, or None; HINDSIGHT_BROWSER goes first."""
    named = os.environ.get("HINDSIGHT_BROWSER")
    if named:
        return named if os.access(named, os.X_OK) else None
    return next((path for name in BROWSER_NAMES if (path := shutil.which(name))), None)
