"""The compiled and the numpy path give the same numbers, and either works alone."""

import importlib
import os
import subprocess
import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

from app.core import AssistanceSettings, CoreError, assist, backend, exact, initial_state, preset
from app.core import value_slice as draw_slice
from app.core.belief import bounded
from app.core.types import Array, Goals, Pose

from . import scenes

VARIANTS = [
    preset("default"),
    preset("default", idle_drift=1.0, evidence_half_life=2.0, prior=(0.2, 0.3, 0.1, 0.4)),
    preset("default", temperature=0.3, belief_floor=0.05, belief_max=0.8),
    preset("default", belief_floor=0.0, belief_max=1.0),
    preset("paper"),
    preset("ada"),
    preset("ada", temperature=0.5),
    preset("ada", step="exact", w_translation=5.0),
    preset("default", translation_aside=1.4, step="exact"),
    preset("ada", translation_aside=3.0),
]
FIELDS = ("direct", "assistance", "twist", "belief", "values", "q_values", "best_targets")


def run(
    choice: str, variant: AssistanceSettings, goals: Goals, poses: list[Pose], inputs: list[Array]
) -> list[Array]:
    """Return every field of every step of a short trial."""
    backend.use_kernels(choice)
    try:
        state, found = initial_state(goals, variant), []
        for pose, direct in zip(poses, inputs, strict=True):
            state, step = assist(variant, goals, state, pose, direct, 0.01)
            found.extend(getattr(step, name) for name in FIELDS)
        return found
    finally:
        backend.use_kernels()


@pytest.mark.parametrize("variant", VARIANTS)
@settings(max_examples=30, deadline=None)
@given(seed=scenes.seeds)
def test_compiled_and_numpy_agree(variant: AssistanceSettings, seed: int) -> None:
    """Every number of every step agrees to 1e-12, with and without rotation and input."""
    rng = np.random.default_rng(seed)
    goals = scenes.random_goals(rng, 4, int(rng.integers(1, 9)))
    poses = [scenes.random_pose(rng) for _ in range(6)]
    inputs = [scenes.random_twist(rng, rotating=i % 2 == 0) * (i != 3) for i in range(6)]
    compiled = run("compiled", variant, goals, poses, inputs)
    plain = run("numpy", variant, goals, poses, inputs)
    for a, b in zip(compiled, plain, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    "name", ["PASSES", "COARSE", "TOLERANCE", "RESTART_GOALS", "SHORT_OF_TARGET"]
)
def test_the_exact_steps_constants_are_one(name: str) -> None:
    """The kernels hold their own copies, for the sake of the cache."""
    kernels = importlib.import_module("app.core.kernels")
    assert getattr(kernels, name) == getattr(exact, name)
    assert kernels.STARTS == 2 + exact.RESTART_GOALS * exact.RESTART_TARGETS


@pytest.mark.parametrize("aside", [1.0, 1.5])
@pytest.mark.parametrize("kind", ["min", "soft-min"])
def test_slices_agree(kind: str, aside: float) -> None:
    """A value slice is the same compiled and in numpy, and the same as V at each point."""
    rng = np.random.default_rng(3)
    goals = scenes.random_goals(rng, 3, 16)
    variant = preset("default", translation_aside=aside)
    quaternion = scenes.random_quaternions(rng, 1)[0]
    drawn = {}
    for choice in ("compiled", "numpy"):
        backend.use_kernels(choice)
        drawn[choice] = draw_slice(
            variant,
            goals,
            [0.5, 0.3, 0.2],
            [0.0, -0.3, 0.1],
            [0.6, 0.0, 0.1],
            [0.0, 0.6, 0.0],
            (7, 5),
            quaternion,
            kind=kind,  # type: ignore[arg-type]
        )
    backend.use_kernels()
    np.testing.assert_allclose(drawn["compiled"], drawn["numpy"], rtol=1e-12, atol=1e-12)
    if kind == "min":
        point = Pose(np.array([0.3, 0.3, 0.15]), quaternion)  # i = 3 of 6, j = 4 of 4
        state = initial_state(goals, variant)
        _, step = assist(variant, goals, state, point, np.zeros(6), 0.01)
        assert drawn["compiled"][3, 4] == pytest.approx(step.values @ [0.5, 0.3, 0.2], abs=1e-12)


@pytest.mark.parametrize("equal", [False, True])
@settings(max_examples=200, deadline=None)
@given(seed=scenes.seeds)
def test_bounds_agree_and_hold(equal: bool, seed: int) -> None:
    """Bounded beliefs sum to one, keep cap and floor, and bounding them again changes nothing."""
    kernels = importlib.import_module("app.core.kernels")
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 40))
    weights = rng.normal(scale=rng.choice([0.1, 3.0, 300.0]), size=n)
    highest, lowest = float(rng.choice([0.9, 0.99, 1.0])), float(rng.choice([0.0, 0.005, 0.2]))
    found = bounded(weights, highest, lowest, equal)
    compiled = weights.copy()
    kernels.bound(compiled, highest, lowest, equal)
    np.testing.assert_allclose(compiled, found, rtol=1e-12, atol=1e-12)
    b = np.exp(found)
    assert b.sum() == pytest.approx(1.0, abs=1e-12)
    assert b.max() <= highest + 1e-12
    assert b.min() >= min(lowest, max(1.0 - highest, 0.01) / (n - 1)) - 1e-12
    np.testing.assert_allclose(bounded(found, highest, lowest, equal), found, atol=1e-12)


def test_a_failing_numba_warns_once_and_numpy_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a working numba the core says so once and gives the same results."""
    goals = scenes.three_goals_in_line()
    pose, variant = Pose(np.zeros(3), scenes.IDENTITY), preset("default")
    direct = np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    _, expected = assist(variant, goals, initial_state(goals, variant), pose, direct, 0.01)

    def fail(name: str) -> None:
        raise ImportError(f"no {name} today")

    monkeypatch.setattr(backend.importlib, "import_module", fail)
    monkeypatch.setattr(backend, "_active", None)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        state = initial_state(goals, variant)
        steps = [assist(variant, goals, state, pose, direct, 0.01)[1] for _ in range(3)]
    assert [str(warning.message) for warning in caught] == [
        "kernels are not compiled (ImportError: no app.core.compiled_backend today); "
        "going on with numpy, about 20 times slower"
    ]
    np.testing.assert_allclose(steps[0].twist, expected.twist, atol=1e-12)
    with pytest.raises(CoreError, match="cannot be compiled"):
        backend.use_kernels("compiled")


def test_an_unknown_choice_of_kernels_is_refused() -> None:
    """The message names the valid choices."""
    with pytest.raises(CoreError, match="auto, compiled, numpy, got 'fortran'"):
        backend.use_kernels("fortran")


def test_arrays_of_another_layout_are_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Read-only, strided or single-precision goals give the results of plain ones."""
    rng = np.random.default_rng(5)
    goals, pose = scenes.random_goals(rng, 3, 4), scenes.random_pose(rng)
    variant, direct = preset("default", method="autonomy"), scenes.random_twist(rng)
    state = initial_state(goals, variant)
    _, expected = assist(variant, goals, state, pose, direct, 0.01)
    wide = np.zeros((goals.n_targets, 6))
    wide[:, ::2] = goals.positions
    strided = replace(goals, positions=wide[:, ::2])
    strided.quaternions.setflags(write=False)
    backwards = Pose(pose.position[::-1].copy()[::-1], pose.quaternion)
    _, step = assist(variant, strided, state, backwards, direct, 0.01)
    for name in FIELDS:
        np.testing.assert_allclose(getattr(step, name), getattr(expected, name), atol=1e-12)


@pytest.mark.slow
def test_kernels_compile_where_no_cache_can_be_written() -> None:
    """A read-only installation compiles without the cache and without a word."""
    script = (
        "import numba.core.caching as caching\n"
        "for name in list(vars(caching)):\n"
        "    if hasattr(getattr(caching, name), '_locator_classes'):\n"
        "        getattr(caching, name)._locator_classes = []\n"
        "import app.core; print(app.core.warm_up())"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        capture_output=True,
        text=True,
        env={**os.environ, "HINDSIGHT_KERNELS": "auto"},
        check=False,
    )
    assert (done.returncode, done.stdout.strip()) == (0, "compiled"), done.stderr
