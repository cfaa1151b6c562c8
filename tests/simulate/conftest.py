import pytest

from app.robot.scene import Scene
from app.robot.scene_file import load_scene


@pytest.fixture(scope="session")
def scene() -> Scene:
    """The default scene."""
    return load_scene("default")
