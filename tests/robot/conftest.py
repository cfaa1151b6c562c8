"""Fixtures of the robot room's tests."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from app.robot import GraspTargets, Scene, grasp_targets, load_scene
from app.robot.scene_file import SCENES


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Tests neither read nor fill the cache of the person who runs them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def scene() -> Scene:
    """The scene of a first trial."""
    return load_scene("default")


@pytest.fixture(scope="session")
def targets(scene: Scene) -> GraspTargets:
    """Targets of the default scene."""
    return grasp_targets(scene)


@pytest.fixture
def scene_text() -> str:
    """The default scene's file."""
    return Path(SCENES / "default.yaml").read_text(encoding="utf-8")
