"""Grasps found once are kept in the user's cache folder, by a hash of all they depend on."""

import hashlib
import os
import struct
import tempfile
from importlib.metadata import version
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from app.core.types import Array
from app.robot.scene import Scene

_HERE = Path(__file__).parent
_SOURCES = (
    "arm.xml", "arm.py", "grasps.py", "inverse.py", "kinematics.py", "model.py", "objects.py",
    "reachability.py", "rotations.py", "targets.py",
)  # fmt: skip
"""Files whose text decides which grasps are found."""


def cache_folder() -> Path:
    """$XDG_CACHE_HOME/hindsight, or ~/.cache/hindsight."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path("~/.cache").expanduser()) / "hindsight"


def cache_key(scene: Scene) -> str:
    """Hash of the scene's geometry, the program's files and the libraries that decide."""
    digest = hashlib.sha256()
    digest.update(scene.model_dump_json(exclude={"title", "time_limit_s"}).encode())
    for name in _SOURCES:
        digest.update((_HERE / name).read_bytes())
    for package in ("mujoco", "pin", "numpy"):
        digest.update(f"{package} {version(package)}".encode())
    return digest.hexdigest()[:32]


def read_cache(key: str) -> list[Array] | None:
    """Grasps per object, or None where they are not there or not whole."""
    try:
        # Opened here, because np.load forgets to close what turns out to be no archive.
        with open(cache_folder() / f"grasps-{key}.npz", "rb") as file:
            with np.load(file, allow_pickle=False) as stored:
                grasps = [stored[f"object_{i}"] for i in range(len(stored.files))]
    except (
        OSError,
        ValueError,
        LookupError,
        AttributeError,
        TypeError,
        EOFError,
        BadZipFile,
        struct.error,
    ):
        return None
    whole = all(part.ndim == 3 and part.shape[1:] == (4, 4) and len(part) for part in grasps)
    return grasps if grasps and whole else None


def write_cache(key: str, grasps: list[Array]) -> None:
    """Keep grasps; written beside and renamed, so that readers never see half a file.

    A cache that cannot be written only costs time, so that is no error.
    """
    folder = cache_folder()
    partial = None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, suffix=".part", delete=False) as file:
            partial = Path(file.name)
            arrays = {f"object_{i}": part for i, part in enumerate(grasps)}
            np.savez(file, allow_pickle=False, **arrays)
        os.replace(partial, folder / f"grasps-{key}.npz")
    except OSError:
        if partial is not None:
            partial.unlink(missing_ok=True)
