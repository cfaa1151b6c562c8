"""Python and its packages: new enough, complete, and the versions that were tried together."""

import sys
from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from packaging.requirements import InvalidRequirement, Requirement
from packaging.utils import canonicalize_name

import app
from app.core import warm_up
from app.doctor.finding import Finding
from app.errors import AppError

LEAST_PYTHON = (3, 11)
LOCK = Path(app.__file__).parent.parent / "requirements.lock"
INSTALL = "`make install` in the folder of the program installs the locked packages"
NAMED = 4
"""How many packages a line names before it says only how many more there are."""


def check_python() -> Finding:
    """Whether Python is new enough."""
    text = sys.version.split()[0]
    if sys.version_info < LEAST_PYTHON:
        needed = ".".join(map(str, LEAST_PYTHON))
        return Finding("Python", "bad", text, f"install Python {needed} or newer")
    return Finding("Python", "ok", text)


def check_packages(
    lock: Path = LOCK, installed: Callable[[str], str | None] | None = None
) -> Finding:
    """Whether all packages are there, in the locked versions.

    Args:
        lock: The lock file.
        installed: Version of a package, None where it is missing; None: as Python sees it.
    """
    look = installed or installed_version
    missing = [name for name in _needed() if look(name) is None]
    if missing:
        return Finding("Packages", "bad", f"missing: {_names(missing)}", INSTALL)
    try:
        locked = read_lock(lock)
    except (OSError, InvalidRequirement) as error:
        return Finding("Packages", "warn", f"no lock file to compare with: {error}", INSTALL)
    others = [
        f"{name} {found} instead of {wanted}"
        for name, wanted in locked.items()
        if (found := look(name)) not in (None, wanted)
    ]
    if others:
        return Finding("Packages", "warn", f"not as locked: {_names(others)}", INSTALL)
    return Finding("Packages", "ok", f"all {len(locked)} as locked")


def check_kernels() -> Finding:
    """Whether the assistance is compiled: numpy alone is several times slower."""
    try:
        how = warm_up()
    except Exception as error:  # numba and LLVM fail in many ways
        return Finding("Kernels", "bad", f"cannot be loaded: {error}", INSTALL)
    if how != "compiled":
        text = "not compiled: fewer sessions at once, large scenes slow"
        advice = "reinstall numba (`make install`), and see that its cache folder can be written"
        return Finding("Kernels", "warn", text, advice)
    return Finding("Kernels", "ok", "compiled")


def check_pages() -> Iterator[Finding]:
    """Whether the page, viser's client and the plotting library are where they should be."""
    from app.web import vendor
    from app.web.pages import STATIC
    from app.web.viewer_page import viewer_page

    try:
        viewer_page()
        if not (STATIC / "index.html").is_file():
            raise AppError(f"the page is missing: {STATIC / 'index.html'}")
    except AppError as error:
        yield Finding("Page", "bad", str(error), INSTALL)
    else:
        yield Finding("Page", "ok", "page and viewer are in place")
    if not vendor.installed():
        text = "missing: the review page shows no plots"
        yield Finding("Plotting library", "warn", text, "`make plots`, once the network is there")


def read_lock(lock: Path) -> Mapping[str, str]:
    """Locked version of each package that this Python on this system is to have.

    Raises:
        OSError: If the file cannot be read.
        InvalidRequirement: If it is no lock file.
    """
    pinned: dict[str, str] = {}
    for line in lock.read_text(encoding="utf-8").splitlines():
        text = line.split("--hash")[0].rstrip(" \\").strip()
        if not text or text.startswith(("#", "-")):
            continue
        requirement = Requirement(text)
        if requirement.marker is None or requirement.marker.evaluate():
            pinned[canonicalize_name(requirement.name)] = str(requirement.specifier).lstrip("=")
    return pinned


def installed_version(name: str) -> str | None:
    """Version of an installed package; None where there is none."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _needed() -> list[str]:
    """Packages that the program itself asks for."""
    try:
        asked = [Requirement(text) for text in requires("hindsight") or ()]
    except PackageNotFoundError:
        return ["hindsight"]
    return [r.name for r in asked if r.marker is None or r.marker.evaluate()]


def _names(names: list[str]) -> str:
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more
