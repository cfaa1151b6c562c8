"""Scene files: the shipped ones are valid; a bad one leads to the line and says what is valid."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.robot import Scene, SceneError, list_scenes, load_scene, random_layout
from app.robot.scene_file import read_scene


def _line_of(text: str, part: str) -> int:
    return next(i for i, line in enumerate(text.splitlines(), start=1) if part in line)


def test_shipped_scenes_are_valid_and_default_comes_first() -> None:
    """Every scene in the package loads under its own name."""
    assert list_scenes()[0] == "default"
    assert {"default", "clutter", "in-line"} <= set(list_scenes())
    for name in list_scenes():
        assert load_scene(name).name == name


def test_the_default_scene_is_canteen_block_and_glass(scene: Scene) -> None:
    """The paper's three objects, with the masses that were tried in physics."""
    assert scene.object_names == ("canteen", "block", "glass")
    assert [item.mass_kg for item in scene.objects] == [0.34, 0.25, 0.20]


def test_a_copied_scene_loads_by_its_path(tmp_path: Path, scene_text: str, scene: Scene) -> None:
    """A user's copy means the same as the shipped file."""
    path = tmp_path / "mine.yaml"
    path.write_text(scene_text, encoding="utf-8")
    assert load_scene(path) == load_scene(str(path)) == scene


def test_in_line_is_in_line_with_the_hand() -> None:
    """Seen from the start of the hand, both places lie in one direction, within 2°."""
    from app.robot import Kinematics

    scene = load_scene("in-line")
    hand = Kinematics(scene).hand_pose(scene.start_joint_positions).position[:2]
    near, far = (np.array([p.x_m, p.y_m]) - hand for p in scene.places)
    cosine = near @ far / (np.linalg.norm(near) * np.linalg.norm(far))
    assert np.degrees(np.arccos(cosine)) < 2.0


BAD = [
    ("mass_kg: 0.25", "mass_kg: -3", "objects[1].mass_kg", "-3", "at least 0.02"),
    ("mass_kg: 0.25", "mass_kg: heavy", "objects[1].mass_kg", "'heavy'", "valid number"),
    ("mass_kg: 0.25", "mass_kg: .nan", "objects[1].mass_kg", "nan", "finite"),
    ("kind: glass", "kind: vase", "objects[2]", "'vase'", "canteen, glass, cylinder, block, box"),
    ("colour: sky", "colour: pink", "objects[2].colour", "'pink'", "'vermilion'"),
    ("radius_m: 0.035", "radius_m: 0.06", "objects[0].radius_m", "0.06", "at most 0.045"),
    ("radius_m: 0.035", "radios_m: 0.03", "objects[0].radios_m", "no field", "docs/scenes.md"),
    ("name: glass", "name: block", "objects[2].name", "'block'", "name of its own"),
    ("name: glass", "name: Glass 1", "objects[2].name", "'Glass 1'", "no name"),
    ("x_m: 0.85", "x_m: 1.70", "places[1].x_m", "1.7", "valid: -0.1"),
    ("x_m: 0.85", "x_m: 0.1", "places[1].x_m", "robot's base", "0.25"),
    ("y_m: 0.0}", "y_m: 0.2}", "places[1].x_m", "'middle'", "apart"),
    ("size_m: [0.05, 0.06, 0.10]", "size_m: [0.12, 0.1, 0.10]", "objects[1].size_m", "fit", "0.09"),
    ("size_m: [0.05, 0.06, 0.10]", "size_m: [0.05]", "objects[1].size_m[1]", "missing", "value"),
    ("x_m: 0.82, y_m: 0.22", "x_m: left, y_m: 0.22", "places[0].x_m", "'left'", "valid number"),
    ("time_limit_s: 60", "time_limit_s: 0", "time_limit_s", "0", "at least 5"),
    ("140.2", "190", "start_degrees[3]", "190", "20 to 147.2"),
    ("name: right", "name: left", "places[2].name", "'left'", "name of its own"),
]


@pytest.mark.parametrize(("old", "new", "field", "value", "valid"), BAD)
def test_a_bad_field_is_named_with_its_line_value_and_what_is_valid(
    tmp_path: Path, scene_text: str, old: str, new: str, field: str, value: str, valid: str
) -> None:
    """The first line of the message leads a person to the fault and out of it."""
    assert old in scene_text
    text = scene_text.replace(old, new, 1)
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    first = str(caught.value).splitlines()[0]
    head = f"{path}, line "
    assert first.startswith(head)
    assert f", {field}: " in first
    assert value in first and valid in first
    number = int(first[len(head) :].split(",")[0])
    # The field's own line, or that of its object where the field itself is missing or unknown.
    assert abs(number - _line_of(scene_text, old)) <= (2 if field.endswith("]") else 0), first


def test_a_missing_field_and_too_few_places_are_named(tmp_path: Path, scene_text: str) -> None:
    """Problems of what is not there are told where it should be."""
    path = tmp_path / "mine.yaml"
    path.write_text(scene_text.replace("title: Canteen, block and glass\n", ""), encoding="utf-8")
    with pytest.raises(SceneError, match="title: is missing"):
        load_scene(path)
    kept = [line for line in scene_text.splitlines() if "name: right" not in line]
    path.write_text("\n".join(kept), encoding="utf-8")
    with pytest.raises(SceneError, match="places: 2 places for 3 objects; valid: at least 3"):
        load_scene(path)


def test_all_problems_are_told_at_once(tmp_path: Path, scene_text: str) -> None:
    """Two faults in two lines give two lines of message."""
    text = scene_text.replace("colour: sky", "colour: pink").replace("mass_kg: 0.25", "mass_kg: 9")
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    assert len(str(caught.value).splitlines()) == 2


@pytest.mark.parametrize("content", [b"", b"- 1\n- 2\n", b"name: [", b"\xff\xfe\x00", b"a: *b\n"])
def test_what_is_no_scene_is_refused(tmp_path: Path, content: bytes) -> None:
    """Empty, a list, broken YAML, no UTF-8, an unknown alias."""
    path = tmp_path / "mine.yaml"
    path.write_bytes(content)
    with pytest.raises(SceneError, match="mine.yaml"):
        load_scene(path)


def test_an_unknown_scene_names_the_known_ones() -> None:
    """A mistyped name is answered by the names there are."""
    with pytest.raises(SceneError, match="'nowhere'.*default, clutter"):
        load_scene("nowhere")


def test_a_huge_file_is_refused(tmp_path: Path) -> None:
    """A file far too large for a scene is not even parsed."""
    path = tmp_path / "huge.yaml"
    path.write_text("#" * 300_000, encoding="utf-8")
    with pytest.raises(SceneError, match="300000 bytes"):
        load_scene(path)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_broken_scenes_never_raise_anything_but_a_scene_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Lines of the default scene dropped, doubled and overwritten."""
    from app.robot.scene_file import SCENES

    lines = (SCENES / "default.yaml").read_text(encoding="utf-8").splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(lines) - 1))
        junk = data.draw(
            st.one_of(
                st.text(max_size=20),
                st.sampled_from(
                    ["- x", "  - {", "objects: 3", "places: {a: 1}", "? [1]: 2", "---"]
                ),
            )
        )
        lines[at : at + data.draw(st.integers(0, 2))] = [junk]
    path = tmp_path_factory.getbasetemp() / "fuzzed.yaml"
    path.write_text("\n".join(lines), encoding="utf-8", errors="replace")
    try:
        assert isinstance(read_scene(path), Scene)
    except SceneError as error:
        assert "fuzzed.yaml" in str(error)


def test_layouts_that_do_not_fit_are_refused(scene: Scene) -> None:
    """Too few, one twice, one unknown, one negative."""
    for layout in [(0, 1), (0, 0, 1), (0, 1, 3), (-1, 0, 1)]:
        with pytest.raises(SceneError, match="3 different places out of 0 to 2"):
            scene.checked_layout(layout)


def test_every_order_of_the_objects_is_equally_probable_and_seeded(scene: Scene) -> None:
    """χ² over the six orders, 3000 draws; 99.9 % point at 5 degrees of freedom is 20.5."""
    rng = np.random.default_rng(1)
    drawn = [random_layout(scene, rng) for _ in range(3000)]
    _, counts = np.unique(drawn, axis=0, return_counts=True)
    assert len(counts) == 6
    assert ((counts - 500.0) ** 2 / 500.0).sum() < 20.5
    again = np.random.default_rng(1)
    assert drawn[:5] == [random_layout(scene, again) for _ in range(5)]
