"""One viser server for all tests of the view, emptied between them."""

import contextlib
import io
from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
import viser

from app.bench.scene import moving_records
from app.core import make_goals, preset
from app.core.settings import AssistanceSettings
from app.core.types import Goals
from app.recording.schema import StepRecord
from app.robot.scene import Scene
from app.robot.scene_file import load_scene
from app.session.drawing import Viewer

LEVEL = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])


@pytest.fixture(scope="session")
def running_server() -> Iterator[viser.ViserServer]:
    """One server on a free port."""
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


@pytest.fixture
def server(running_server: viser.ViserServer) -> Iterator[viser.ViserServer]:
    """The server with an empty scene afterwards."""
    yield running_server
    running_server.scene.reset()


@pytest.fixture(scope="session")
def scene() -> Scene:
    """The scene that comes first."""
    return load_scene("default")


@pytest.fixture
def viewer(server: viser.ViserServer, scene: Scene) -> Iterator[Viewer]:
    """A view of the default scene."""
    view = Viewer(server, scene)
    yield view
    view.close()


@pytest.fixture(scope="session")
def records(scene: Scene) -> list[StepRecord]:
    """Ticks of a moving arm."""
    ticks = moving_records(scene, 12)
    return [msgspec.structs.replace(tick, best_targets=[0, 2, 4]) for tick in ticks]


@pytest.fixture(scope="session")
def goals(scene: Scene) -> Goals:
    """Two targets at every object."""
    return make_goals(
        {
            item.name: (
                np.array([[place.x_m, place.y_m, 0.06], [place.x_m, place.y_m, 0.08]]),
                np.tile(LEVEL, (2, 1)),
            )
            for item, place in zip(scene.objects, scene.places, strict=False)
        }
    )


@pytest.fixture(scope="session")
def settings() -> AssistanceSettings:
    """The default assistance."""
    return preset("default", method="policy")


@pytest.fixture
def node(server: viser.ViserServer) -> Callable[[str], Any]:
    """Look a node of the scene up by its name."""

    def find(name: str) -> Any:
        handle = server.scene.get_handle_by_name(name)
        assert handle is not None, f"no node {name}"
        return handle

    return find
