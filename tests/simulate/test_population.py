"""Population files: what they may say, and how the impossible is refused."""

from pathlib import Path

import numpy as np
import pytest

from app.robot.scene import Scene
from app.simulate.errors import SimulateError
from app.simulate.models import MODELS
from app.simulate.population import (
    check_possible,
    list_populations,
    load_population,
    with_parameters,
)


def write(folder: Path, text: str) -> Path:
    """A population file with this text."""
    path = folder / "people.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_every_shipped_population_loads_and_is_described(scene: Scene):
    """And is possible in the default scene."""
    assert {"paper-like", "maxent", "confirmation", "edge-cases"} <= set(list_populations())
    for name in list_populations():
        population = load_population(name)
        assert population.name == name
        assert len(population.description) > 40
        check_possible(population, scene)


def test_every_model_is_shipped_in_some_population():
    """Nobody has to write a file to meet one."""
    shipped = {k.model for n in list_populations() for k in load_population(n).kinds}
    assert shipped == set(MODELS)


def test_draws_follow_weights_and_ranges():
    """Shares as weighted, values inside their range, one value where there is no range."""
    population = load_population("paper-like")
    rng = np.random.default_rng(1)
    users = [population.draw(rng) for _ in range(2000)]
    shares = {m: np.mean([model == m for model, _ in users]) for m in ("continue", "lazy", "fight")}
    assert shares == pytest.approx({"continue": 0.7, "lazy": 0.2, "fight": 0.1}, abs=0.04)
    delays = np.array([parameters["delay_s"] for _, parameters in users])
    assert 0.2 <= delays.min() < 0.21 and 0.29 < delays.max() <= 0.3
    assert {parameters["tolerance_m"] for _, parameters in users} == {0.01}
    for model, parameters in users[:50]:
        assert set(parameters) == set(MODELS[model].PARAMETERS)


def test_own_parameters_win_over_common_ones(tmp_path: Path):
    """A model's own value is the more particular."""
    path = write(
        tmp_path,
        "parameters: {noise: 0.5}\n"
        "users: [{model: continue}, {model: lazy, parameters: {noise: [0.1, 0.2]}}]\n",
    )
    first, second = load_population(path).kinds
    assert first.ranges["noise"] == (0.5, 0.5)
    assert second.ranges["noise"] == (0.1, 0.2)


def test_fixing_a_parameter_reaches_whoever_has_it():
    """And nobody else."""
    people = with_parameters(load_population("paper-like"), {"resistance": 2.0, "noise": 0.9})
    for kind in people.kinds:
        assert kind.ranges["noise"] == (0.9, 0.9)
        assert kind.ranges.get("resistance") in (None, (2.0, 2.0))
    with pytest.raises(SimulateError, match=r"'push_s'; valid: .*delay_s"):
        with_parameters(load_population("paper-like"), {"push_s": 1.0})


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[1, 2]", ["mapping"]),
        ("{name: x}", ["users", "at least one"]),
        ("{users: []}", ["at least one"]),
        ("{users: [{model: robot}]}", ["'robot'", *MODELS]),
        ("{users: [{weight: 1}]}", ["None", *MODELS]),
        ("{users: [{model: lazy, weight: 0}]}", ["weight is 0", "above 0"]),
        ("{users: [{model: lazy, weight: many}]}", ["'many'"]),
        ("{users: [{model: lazy, parameters: {speed: 1}}]}", ["'speed'", "vigour"]),
        ("{users: [{model: lazy, parameters: {vigour: 3}}]}", ["vigour is 3", "0.02 to 1"]),
        ("{users: [{model: lazy, parameters: {delay_s: [0.3, 0.2]}}]}", ["[0.3, 0.2]"]),
        ("{users: [{model: lazy, parameters: {delay_s: [1, .nan]}}]}", ["nan"]),
        ("{users: [{model: lazy}], parameters: {push_s: 1}}", ["'push_s'", "delay_s"]),
        ("{users: [{model: lazy, wait: 1}]}", ["'wait'", "weight"]),
        ("{people: []}", ["'people'", "users"]),
        ("{users: [", ["cannot be read"]),
    ],
)
def test_a_bad_file_is_told_by_name_field_and_what_is_valid(
    tmp_path: Path, text: str, said: list[str]
):
    """All of it in one message."""
    path = write(tmp_path, text)
    with pytest.raises(SimulateError) as error:
        load_population(path)
    for word in [str(path), *said]:
        assert word in str(error.value)


def test_unknown_users_list_the_shipped_ones(tmp_path: Path):
    """A name that is none, and a file that is not there."""
    with pytest.raises(SimulateError, match=r"'students' are unknown; valid: .*paper-like"):
        load_population("students")
    with pytest.raises(SimulateError, match="cannot be read"):
        load_population(tmp_path / "none.yaml")


def test_impossible_populations_say_why(scene: Scene):
    """Nobody changes their mind where there is nothing else; nobody reacts after the end."""
    alone = scene.model_copy(update={"objects": scene.objects[:1]})
    with pytest.raises(SimulateError, match="changes-mind needs 1 object beside"):
        check_possible(load_population("edge-cases"), alone)
    hurried = scene.model_copy(update={"time_limit_s": 0.2})
    with pytest.raises(SimulateError, match=r"reacts after 0.3 s, the trial ends at 0.2 s"):
        check_possible(load_population("paper-like"), hurried)
