"""Study files: the shipped ones are valid; what is wrong is named with line, field and value."""

from pathlib import Path

import pytest

from app.robot.scene_file import load_scene
from app.robot.targets import grasp_targets
from app.study.check import check
from app.study.errors import AnswerError, StudyError
from app.study.items import check_answers, ineligible, survey_items
from app.study.load import HERE, list_studies, list_surveys, load_study
from app.study.server.spec import free_scene
from app.study.sheet import run_sheet
from tests.study.builders import BACKGROUND, paper, survey_answers

TEXT = (HERE / "paper.yaml").read_text(encoding="utf-8")


def test_the_shipped_study_is_the_papers():
    """Two methods, both orders, the four statements, a preference, three background questions."""
    study = load_study("paper")
    assert list_studies() == ("paper",) and set(list_surveys()) == {"paper", "nasa-tlx"}
    assert [c.method for c in study.conditions] == ["blend", "policy"]
    items = survey_items(study.surveys[0], study.labels)
    assert list(items)[:4] == [f"method1/{i}" for i in ("control", "wanted", "quickly", "like")]
    assert {"prefer", "reasons", "comments"} <= set(items)
    assert [i.id for i in study.background] == ["gender", "experience", "prior_exposure"]
    assert all(c.display == "nothing" for c in study.conditions) and not study.rotation


def test_check_names_orders_trials_and_duration():
    """What `study check` prints."""
    text = check(paper())
    assert "cell 1: method1 = blend, method2 = policy" in text
    assert "cell 2: method1 = policy, method2 = blend" in text
    assert "6 recorded, 6 training" in text and "min per participant" in text


def test_the_run_sheet_fits_a_page_and_names_no_method():
    """The experimenter beside the participant stays blind, too."""
    text = run_sheet(paper())
    assert "method1, method2" in text
    assert "blend" not in text and "policy" not in text


@pytest.mark.parametrize(
    ("old", "new", "line_with", "words"),
    [
        ("order: full", "order: latin", "order: latin", ["order", "'latin'", "'full'", "williams"]),
        ("method: policy}", "method: magic}", "method: magic", ["conditions[1].method", "direct"]),
        ("free_s: 60", "free_s: -1", "free_s: -1", ["training.free_s", "at least 0"]),
        ("surveys: [paper]", "surveys: [likes]", "surveys:", ["'likes'", "nasa-tlx"]),
        ("scene: default", "scene: kitchen", "scene: kitchen", ["kitchen", "default"]),
        ("order: full", "ordre: full", "ordre: full", ["ordre", "no field"]),
        (
            "kind: choice\n    text: What",
            "kind: chooze\n    text: What",
            "gender",
            ["kind", "likert"],
        ),
        ("name: policy,", "name: blend,", "name: blend, method: policy", ["'blend' is taken"]),
        ("reference: blend", "reference: none", "reference: none", ["blend, policy"]),
    ],
)
def test_a_bad_field_is_named_with_its_line(
    tmp_path: Path, old: str, new: str, line_with: str, words: list[str]
):
    """Before anything starts, and for a person who has the file open."""
    assert old in TEXT
    path = tmp_path / "study.yaml"
    path.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(StudyError) as error:
        load_study(path)
    message = str(error.value)
    lines = path.read_text(encoding="utf-8").splitlines()
    number = next(i for i, line in enumerate(lines, 1) if line_with in line)
    assert f"{path}, line {number}" in message
    assert all(word in message for word in words), message


@pytest.mark.parametrize("text", ["a: [", "- just\n- a list", "\t", "name: x\nname: y"])
def test_broken_yaml_is_said(tmp_path: Path, text: str):
    """With the file's name."""
    path = tmp_path / "study.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(StudyError, match=r"study\.yaml"):
        load_study(path)


def test_answers_out_of_range_are_named_one_by_one():
    """Every bad answer at once, each with what is valid."""
    items = survey_items(paper().surveys[0], ("method1", "method2"))
    good = survey_answers(paper(), comments="fine")
    assert check_answers(items, good) == good
    bad = {**good, "prefer": 8, "method1/like": 2.5, "method3/like": 1}
    del bad["method2/control"]
    with pytest.raises(AnswerError) as error:
        check_answers(items, bad)
    assert set(error.value.items) == {"prefer", "method1/like", "method3/like", "method2/control"}
    assert "valid: 1 to 7" in error.value.items["prefer"]
    assert check_answers(items, {"prefer": 4}, partial=True) == {"prefer": 4}


def test_screening_names_the_answer():
    """Prior exposure rules out."""
    items = {item.id: item for item in paper().background}
    assert ineligible(items, BACKGROUND) == ""
    assert ineligible(items, {**BACKGROUND, "prior_exposure": "yes"}) == "prior_exposure is yes"


def test_the_table_for_free_practice_is_a_scene_that_loads():
    """Its one object can be grasped, as every scene demands, and stands away from the hand."""
    scene = load_scene(free_scene())
    assert grasp_targets(scene)
    assert [abs(place.y_m) > 0.5 for place in scene.places] == [True]
