"""The core as a library: fifteen lines of use, errors that help, settings as data, no I/O."""

import ast
import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import app.core
from app.core import (
    ARBITRATIONS,
    METHODS,
    PREDICTORS,
    PRESETS,
    CoreError,
    Goals,
    Pose,
    UserInput,
    assist,
    backend,
    compute_command,
    counterfactuals,
    initial_state,
    known_goal_twist,
    make_goals,
    preset,
    settings_from_dict,
    settings_to_dict,
    value_slice,
)
from app.core.settings import METHOD_NAMES, Arbitration, Predictor

from . import scenes

QUATERNION = np.array([1.0, 0.0, 0.0, 0.0])
GOALS = scenes.three_goals_in_line()
POSE = Pose(np.array([0.0, 0.0, 0.2]), QUATERNION)
DIRECT = np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0])

EXAMPLE = """
import numpy as np
from app.core import Pose, assist, initial_state, make_goals, preset

down = [0.0, 1.0, 0.0, 0.0]  # w x y z: the hand's z axis points at the table
goals = make_goals({
    "glass": (np.array([[0.5, -0.2, 0.1], [0.5, -0.2, 0.15]]), np.array([down, down])),
    "block": (np.array([[0.5, 0.2, 0.05]]), np.array([down])),
})
settings = preset("default", method="policy")
state = initial_state(goals, settings)
pose = Pose(np.array([0.1, 0.0, 0.3]), np.array(down))
for _ in range(100):
    direct = np.array([0.1, -0.05, 0.0, 0.0, 0.0, 0.0])  # the user's twist [m/s, rad/s]
    state, step = assist(settings, goals, state, pose, direct, dt=0.01)
print(dict(zip(goals.names, step.belief.round(3))), step.twist.round(3), step.values, step.q_values)
"""


def test_the_example_of_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    """Fifteen lines: goals with targets and user twists in; twist, belief, V and Q out."""
    assert len(EXAMPLE.strip().splitlines()) <= 16
    scope: dict[str, Any] = {}
    exec(EXAMPLE, scope)
    assert "glass" in capsys.readouterr().out
    assert scope["step"].belief[0] > 0.9
    assert scope["step"].twist[0] > 0.1


def test_tables_name_what_settings_accept() -> None:
    """Every entry of the tables can be chosen, and nothing else."""
    assert tuple(METHODS) == METHOD_NAMES
    assert set(ARBITRATIONS) == set(Arbitration.__args__)
    assert set(PREDICTORS) == set(Predictor.__args__)
    for method in METHODS:
        for name in PRESETS:
            assert preset(name, method=method).method == method


def test_settings_survive_json() -> None:
    """A flat dict of JSON values, infinity included, comes back the same."""
    for name in PRESETS:
        settings = preset(name, method="yielding", prior=[0.5, 0.25, 0.25])
        text = json.dumps(settings_to_dict(settings), allow_nan=False)
        assert settings_from_dict(json.loads(text)) == settings
    base = preset("ada")
    assert settings_from_dict({"gain": 0.5}, base) == replace(base, gain=0.5)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"gian": 1.0}, "unknown setting 'gian', valid are method, enabled, gain"),
        ({"gain": 3.0}, "gain must be a number at least 0 and at most 2, got 3.0"),
        ({"gain": math.nan}, "gain must be .*got nan"),
        ({"gain": "much"}, "gain must be .*got 'much'"),
        ({"gain": True}, "gain must be .*got True"),
        ({"w_translation": -1}, "w_translation must be a number above 0, finite, got -1"),
        ({"w_l": -1.0}, "w_l must be a number at least 0 or inf, got -1"),
        ({"beta": math.inf}, "beta must be a number at least 0, finite, got inf"),
        ({"method": "magic"}, "method must be one of direct, blend, policy, .*got 'magic'"),
        ({"arbitration": "x"}, "arbitration must be one of distance, .*got 'x'"),
        ({"enabled": 1}, "enabled must be true or false, got 1"),
        ({"prior": [0.5, 0.0]}, "prior must be numbers above 0"),
        ({"prior": "abc"}, "prior must be numbers above 0"),
        ({"translation_delta": 0.0}, "translation_delta must be a number above 0"),
    ],
)
def test_bad_settings_are_named(values: dict[str, Any], message: str) -> None:
    """The message names the field, the value and what is valid."""
    with pytest.raises(CoreError, match=message):
        settings_from_dict(values)


ONE = np.array([[0.3, 0.0, 0.1]])


@pytest.mark.parametrize(
    ("targets", "message"),
    [
        ({}, "targets must hold at least one goal, got none"),
        ([], "targets must map each goal's name .*got list"),
        ({"a": (np.zeros((0, 3)), np.zeros((0, 4)))}, r"targets\['a'\] must hold at least one"),
        ({"a": (ONE, np.zeros((1, 4)))}, r"quaternions of shape \(1, 4\) must be rotations"),
        ({"a": (ONE[0], [QUATERNION])}, r"positions must have shape \(n, 3\), got \(3,\)"),
        (
            {"a": (ONE, [QUATERNION] * 2)},
            r"as many quaternions as positions.*\(1, 3\) and \(2, 4\)",
        ),
        ({"a": (ONE * np.nan, [QUATERNION])}, r"positions must be finite, got \[\[nan.*\(1, 3\)"),
        ({"a": (ONE, [[np.inf, 0, 0, 0]])}, "quaternions must be finite"),
        ({"a": ("x", [QUATERNION])}, r"positions must be numbers of shape \(n, 3\)"),
        ({"a": ONE}, r"targets\['a'\] must be a pair"),
        ({1: (ONE, [QUATERNION])}, "name must be a non-empty string, got 1"),
    ],
)
def test_bad_goals_are_named(targets: Any, message: str) -> None:
    """The message names the goal, the shape and what is expected."""
    with pytest.raises(CoreError, match=message):
        make_goals(targets)


@pytest.mark.parametrize("kernels", ["compiled", "numpy"])
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pose": Pose(np.array([np.nan, 0, 0]), QUATERNION)}, "pose.position must be finite"),
        (
            {"pose": Pose(np.zeros(2), QUATERNION)},
            r"pose.position must have shape \(3,\), got \(2,\)",
        ),
        ({"pose": Pose(np.zeros(3), np.zeros(4))}, r"pose.quaternion of shape \(4,\) must be rot"),
        ({"pose": Pose(np.zeros(3), QUATERNION[:3])}, r"pose.quaternion must have shape \(4,\)"),
        ({"direct": np.zeros(3)}, r"direct must have shape \(6,\), got \(3,\)"),
        ({"direct": np.full(6, np.inf)}, "direct must be finite"),
        ({"direct": None}, "direct must"),
        ({"dt": 0.0}, "dt must be a time above 0"),
        ({"dt": math.nan}, "dt must be a time above 0"),
        (
            {
                "goals": Goals(
                    GOALS.names, GOALS.positions, GOALS.quaternions, np.array([0, 2, 2, 3])
                )
            },
            "goals must have strictly growing offsets",
        ),
        (
            {"goals": replace(GOALS, positions=GOALS.positions * np.nan)},
            "goals.positions must be finite",
        ),
        (
            {"goals": make_goals({"a": (ONE, [QUATERNION])})},
            "state must be of the same 1 goals, got 3",
        ),
    ],
)
def test_bad_ticks_are_named(kernels: str, changes: dict[str, Any], message: str) -> None:
    """Non-finite poses, rotations beyond repair, wrong shapes: never a wrong number instead."""
    settings = preset("default")
    arguments = {"goals": GOALS, "pose": POSE, "direct": DIRECT, "dt": 0.01} | changes
    backend.use_kernels(kernels)
    try:
        with pytest.raises(CoreError, match=message):
            assist(
                settings,
                arguments["goals"],
                initial_state(GOALS, settings),
                arguments["pose"],
                arguments["direct"],
                arguments["dt"],
            )
    finally:
        backend.use_kernels()


def test_other_bad_arguments_are_named() -> None:
    """Priors, beliefs, goals' names, presets, slices, inputs."""
    settings = preset("default")
    state = initial_state(GOALS, settings)
    with pytest.raises(CoreError, match=r"prior must have one number per goal, shape \(3,\)"):
        initial_state(GOALS, preset("default", prior=(0.5, 0.5)))
    with pytest.raises(CoreError, match="belief must be probabilities"):
        initial_state(GOALS, settings, [1.0, -1.0, 1.0])
    with pytest.raises(CoreError, match="goal must be one of right, middle, left.*got 'up'"):
        known_goal_twist(settings, GOALS, state, POSE, DIRECT, "up")
    with pytest.raises(CoreError, match="pose.position must be finite"):
        counterfactuals(settings, GOALS, state, Pose(POSE.position * np.nan, QUATERNION), DIRECT)
    with pytest.raises(CoreError, match="preset must be one of paper, ada, default, got 'mine'"):
        preset("mine")
    plane = ([0, 0, 0], [1, 0, 0], [0, 1, 0])
    with pytest.raises(CoreError, match="shape must be two numbers of at least 2"):
        value_slice(settings, GOALS, state.belief, *plane, (1, 5), QUATERNION)
    with pytest.raises(CoreError, match="goal must be one of"):
        value_slice(settings, GOALS, state.belief, *plane, (4, 5), QUATERNION, of="up")
    with pytest.raises(CoreError, match="axes must lie in"):
        compute_command(UserInput(axes=(0, 0, 0, 2)), settings)
    with pytest.raises(CoreError, match=r"dead_zone must lie in \[0, 1\)"):
        compute_command(UserInput(dead_zone=1.0), settings)


def test_quaternions_a_little_long_are_mended() -> None:
    """Rounded or scaled quaternions give what unit ones do."""
    goals = replace(GOALS, quaternions=GOALS.quaternions)
    settings = preset("default")
    state = initial_state(goals, settings)
    tilted = np.array([0.6, 0.8, 0.0, 0.0])
    _, expected = assist(settings, goals, state, Pose(POSE.position, tilted), DIRECT, 0.01)
    _, step = assist(settings, goals, state, Pose(POSE.position, tilted * 1.3), DIRECT, 0.01)
    np.testing.assert_allclose(step.values, expected.values, atol=1e-12)


ALLOWED = {
    *("app", "numpy", "numba", "__future__", "ast", "collections", "dataclasses", "functools"),
    *("importlib", "math", "os", "typing", "warnings"),
}
"""`os` only for the environment variable that chooses the kernels."""


def test_the_core_imports_nothing_with_io() -> None:
    """Only numpy, numba, pure standard modules, app.core itself and app.errors."""
    folder = Path(app.core.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        tree = ast.parse(path.read_text())
        for node in ast.walk(tree):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{path.name}: relative import"
                names = [node.module or ""]
            for name in names:
                assert name.split(".")[0] in ALLOWED, f"{path.name} imports {name}"
                if name.startswith("app"):
                    assert name == "app.errors" or name.startswith("app.core"), path.name
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                assert node.func.id not in ("open", "print", "input", "exec", "eval"), path.name
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                if node.value.id == "os":
                    assert node.attr == "environ", f"{path.name} uses os.{node.attr}"
    assert "app.core" in sys.modules
