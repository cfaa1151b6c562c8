"""Scene files and logs that were edited, torn or overwritten: an answer in words, nothing else."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML

from app.recording.errors import RecordingError
from app.recording.listing import list_trials
from app.recording.reader import read_steps, read_trial
from app.recording.recovery import recover_trials
from app.recording.store import open_session, read_events
from app.robot import Scene, SceneError
from app.robot.scene_file import SCENES, read_scene
from tests.fuzz.budget import ANYTHING, SMALL, budget
from tests.recording.samples import make_step
from tests.recording.test_recovery import _log

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]
SHIPPED = sorted(SCENES.glob("*.yaml"))


@given(st.data())
@budget(4 * SMALL)
def test_a_scene_with_any_value_in_any_place(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """A shipped scene with values, keys and lists replaced by anything YAML can say."""
    scene = YAML(typ="safe").load(data.draw(st.sampled_from(SHIPPED)).read_text("utf-8"))
    for _ in range(data.draw(st.integers(1, 3))):
        place, key = scene, None
        while isinstance(place, (dict, list)) and place:
            keys = list(place) if isinstance(place, dict) else list(range(len(place)))
            key = data.draw(st.sampled_from(keys))
            if not isinstance(place[key], (dict, list)) or data.draw(st.booleans()):
                break
            place = place[key]
        if key is not None and isinstance(place, (dict, list)) and place:
            place[key] = data.draw(ANYTHING)
    path = tmp_path_factory.getbasetemp() / "fuzzed-scene.yaml"
    with path.open("w", encoding="utf-8", errors="replace") as file:
        YAML(typ="safe", pure=True).dump(scene, file)
    _read(path)


@given(st.data())
@budget(4 * SMALL)
def test_a_scene_with_any_bytes(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Bytes of a shipped scene overwritten, dropped, doubled."""
    text = bytearray(data.draw(st.sampled_from(SHIPPED)).read_bytes())
    for _ in range(data.draw(st.integers(1, 5))):
        at = data.draw(st.integers(0, len(text)))
        text[at : at + data.draw(st.integers(0, 8))] = data.draw(st.binary(max_size=8))
    path = tmp_path_factory.getbasetemp() / "fuzzed-bytes.yaml"
    path.write_bytes(text)
    _read(path)


def _read(path: Path) -> None:
    try:
        scene = read_scene(path)
    except SceneError as error:
        assert path.name in str(error)
        return
    assert isinstance(scene, Scene)
    assert all(math.isfinite(place.x_m) and math.isfinite(place.y_m) for place in scene.places)


@given(st.data())
@budget(2 * SMALL)
def test_a_damaged_folder_is_listed_read_and_recovered(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """A finished and a torn log with several wounds, a torn list of events: never an exception."""
    root = tmp_path_factory.mktemp("wounded")
    folder = open_session(root, "demo", "p1", "1")
    for name in ("trial-001.mcap", "trial-002.mcap.part"):
        log = bytearray(_log()[0])
        for _ in range(data.draw(st.integers(1, 3))):
            at = data.draw(st.integers(0, len(log)))
            log[at : at + data.draw(st.integers(0, 40))] = data.draw(st.binary(max_size=40))
        (folder / name).write_bytes(log[: data.draw(st.integers(0, len(log)))])
    (folder / "events.jsonl").write_bytes(data.draw(st.binary(max_size=60)))
    for report in recover_trials(root):
        assert report.action != "running"
    for entry in list_trials(root):
        try:
            steps = read_steps(entry.path)
            read_trial(entry.path)
        except RecordingError as error:
            assert str(error)
            continue
        assert steps == [make_step(step.step) for step in steps]
    assert isinstance(read_events(folder), list)
