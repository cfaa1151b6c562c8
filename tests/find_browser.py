"""Find a Chromium for the browser tests, install Debian's where that is allowed, or say how."""

import os
import shutil
import subprocess
import sys

from app.browser import find_browser


def install_debian_chromium() -> None:
    """Install Debian's package without asking: only as root, or where sudo asks no password."""
    if not shutil.which("apt-get"):
        return
    sudo = [] if os.geteuid() == 0 else ["sudo", "-n"]
    if sudo and not shutil.which("sudo"):
        return
    print("No Chromium found; installing Debian's package …", flush=True)
    for command in (["apt-get", "update", "-qq"], ["apt-get", "install", "-y", "-qq", "chromium"]):
        if subprocess.run(sudo + command, stdout=subprocess.DEVNULL, check=False).returncode:
            return


def main() -> int:
    """Exit 0 with the browser's path printed, or 1 with what to type."""
    if not find_browser() and "HINDSIGHT_BROWSER" not in os.environ:
        install_debian_chromium()
    path = find_browser()
    if path:
        print(f"Browser tests use {path}")
        return 0
    print(
        "The browser tests need Chromium or Chrome. On Debian or Ubuntu: "
        "sudo apt-get install chromium. Elsewhere install it and set HINDSIGHT_BROWSER to its "
        f"path (now: {os.environ.get('HINDSIGHT_BROWSER') or 'not set'}).",
        file=sys.stderr,
    )
    return 1


if __name__ == "__main__":
    sys.exit(main())
