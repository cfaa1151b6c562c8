"""What the README says is so."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from app.cli import COMMANDS

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


def test_the_example_runs():
    """The example of the Python API runs as it stands; its belief favours the glass."""
    (example,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
    done = subprocess.run(
        [sys.executable, "-c", example], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.returncode == 0, done.stderr
    glass, block = (float(p) for p in re.findall(r"float64\(([\d.]+)\)", done.stdout)[:2])
    assert glass > 0.9 > 0.1 > block


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_and_links_exist(page: Path):
    """Every `hindsight …` command exists, and every relative link has its file."""
    text = page.read_text()
    for name in re.findall(r"^(?:\.venv/bin/)?hindsight ([a-z]+)", text, re.M):
        assert name in COMMANDS, f"{page.name} names `hindsight {name}`"
    for target in re.findall(r"\]\((?!https?:|#|mailto:)([^)#]+)", text):
        assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_make_targets_exist():
    """Every `make …` of the README is a target of the Makefile."""
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.M))
    named = re.findall(r"`?make ([a-z-]+)", (ROOT / "README.md").read_text())
    assert {"run", "test"} <= set(named) <= targets
