"""Laws the assistance keeps, searched for counterexamples."""

import dataclasses

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from app.core import (
    METHODS,
    AssistanceSettings,
    Goals,
    Pose,
    assist,
    initial_state,
    make_goals,
    preset,
)
from app.core.evaluation import GRADIENT, N_ROWS, evaluate
from app.core.rotations import from_rotation_vector, multiply
from app.core.types import Array

from . import scenes

QUICK = settings(max_examples=60, deadline=None)
FREE = {
    "max_speed": "inf",
    "max_angular_speed": "inf",
    "max_acceleration": "inf",
    "max_angular_acceleration": "inf",
}


def free(**changes: object) -> AssistanceSettings:
    """Return default settings without limits, so that the executed twist is the one asked for."""
    return preset("default", **(FREE | changes))  # type: ignore[arg-type]


def values_at(variant: AssistanceSettings, goals: Goals, pose: Pose) -> Array:
    """Return V_g at a pose."""
    state = initial_state(goals, variant)
    return assist(variant, goals, state, pose, np.zeros(6), 0.01)[1].values


def moved(pose: Pose, twist: Array, seconds: float) -> Pose:
    """Return the pose after a twist: p + τv, exp(τ[ω]×) R."""
    turn = from_rotation_vector(seconds * twist[3:])
    return Pose(pose.position + seconds * twist[:3], multiply(turn, pose.quaternion))


@pytest.mark.parametrize("aside", [1.0, 1.6])
@QUICK
@given(seed=scenes.seeds)
def test_gradients_are_the_slopes_of_the_values(aside: float, seed: int) -> None:
    """∇V by central differences, translation and rotation, away from kinks of the minimum."""
    rng = np.random.default_rng(seed)
    goals, pose = scenes.random_goals(rng, 3, 5), scenes.random_pose(rng)
    variant = free(translation_aside=aside)
    x = np.concatenate([pose.position, pose.quaternion, np.zeros(6)])
    rows, best = np.empty((N_ROWS, 3)), np.empty(3, dtype=np.int64)
    evaluate(variant, goals, x, rows, best)
    h = 1e-6
    for axis in range(6):
        step = np.zeros(6)
        step[axis] = h
        ahead = values_at(variant, goals, moved(pose, step, 1.0))
        behind = values_at(variant, goals, moved(pose, -step, 1.0))
        here = values_at(variant, goals, pose)
        smooth = np.abs(ahead - 2 * here + behind) < 1e-9  # neither target nor branch changes
        slopes = (ahead - behind) / (2 * h)
        np.testing.assert_allclose(rows[GRADIENT + axis][smooth], slopes[smooth], atol=1e-6)
    assert (rows[GRADIENT : GRADIENT + 3] != 0.0).all()


@QUICK
@given(seed=scenes.seeds, method=st.sampled_from(sorted(METHODS)))
def test_order_of_goals_and_targets_does_not_matter(seed: int, method: str) -> None:
    """The belief follows the goals, the twist stays, whatever order they come in."""
    rng = np.random.default_rng(seed)
    goals, pose = scenes.random_goals(rng, 4, 6), scenes.random_pose(rng)
    order = rng.permutation(4)
    rows = [goals.offsets[g] + rng.permutation(6) for g in order]
    shuffled = make_goals(
        {
            goals.names[g]: (goals.positions[own], goals.quaternions[own])
            for g, own in zip(order, rows, strict=True)
        }
    )
    variant, direct = free(method=method), scenes.random_twist(rng)
    state, other = initial_state(goals, variant), initial_state(shuffled, variant)
    state, _ = assist(variant, goals, state, pose, direct, 0.01)
    other, _ = assist(variant, shuffled, other, pose, direct, 0.01)
    _, step = assist(variant, goals, state, pose, direct, 0.01)
    _, again = assist(variant, shuffled, other, pose, direct, 0.01)
    assert step.belief.sum() == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(again.belief, step.belief[order], atol=1e-12)
    np.testing.assert_allclose(again.twist, step.twist, atol=1e-12)


@QUICK
@given(seed=scenes.seeds)
def test_zero_input_changes_nothing(seed: int) -> None:
    """With `calibrated`, no input leaves the belief as it is, to the last bit (Fig. 3a)."""
    rng = np.random.default_rng(seed)
    goals, variant = scenes.random_goals(rng, 4, 5), preset("default")
    state = initial_state(goals, variant)
    state, _ = assist(
        variant, goals, state, scenes.random_pose(rng), scenes.random_twist(rng), 0.01
    )
    for _ in range(3):
        after, step = assist(variant, goals, state, scenes.random_pose(rng), np.zeros(6), 0.01)
        np.testing.assert_array_equal(after.log_belief, state.log_belief)
        np.testing.assert_array_equal(step.belief, state.belief)


@QUICK
@given(seed=scenes.seeds, method=st.sampled_from(sorted(METHODS)))
def test_the_sign_of_a_quaternion_does_not_matter(seed: int, method: str) -> None:
    """Both signs q and −q are one rotation, in the pose and in targets."""
    rng = np.random.default_rng(seed)
    goals, pose = scenes.random_goals(rng, 3, 4), scenes.random_pose(rng)
    variant, direct = free(method=method), scenes.random_twist(rng)
    signs = rng.choice([-1.0, 1.0], size=(goals.n_targets, 1))
    flipped = dataclasses.replace(goals, quaternions=goals.quaternions * signs)
    state = initial_state(goals, variant)
    _, step = assist(variant, goals, state, pose, direct, 0.01)
    turned = Pose(pose.position, -pose.quaternion)
    _, again = assist(variant, flipped, state, turned, direct, 0.01)
    np.testing.assert_allclose(again.twist, step.twist, atol=1e-12)
    np.testing.assert_allclose(again.belief, step.belief, atol=1e-12)


@QUICK
@given(
    seed=scenes.seeds,
    method=st.sampled_from(sorted(METHODS)),
    step=st.sampled_from(["first-order", "exact"]),
)
def test_a_mirrored_scene_gives_the_mirrored_action(seed: int, method: str, step: str) -> None:
    """Mirroring y mirrors v as a vector and ω as an axial vector."""
    rng = np.random.default_rng(seed)
    goals, pose = scenes.random_goals(rng, 3, 4), scenes.random_pose(rng)
    variant, direct = free(method=method, step=step), scenes.random_twist(rng)
    vector, axial = np.array([1.0, -1.0, 1.0]), np.array([-1.0, 1.0, -1.0])
    quaternion_signs = np.concatenate([[1.0], axial])  # the axis mirrors like an axial vector
    twist_signs = np.concatenate([vector, axial])
    mirrored = dataclasses.replace(
        goals,
        positions=goals.positions * vector,
        quaternions=goals.quaternions * quaternion_signs,
    )
    mirrored_pose = Pose(pose.position * vector, pose.quaternion * quaternion_signs)
    state = initial_state(goals, variant)
    _, there = assist(variant, goals, state, pose, direct, 0.01)
    _, here = assist(variant, mirrored, state, mirrored_pose, direct * twist_signs, 0.01)
    np.testing.assert_allclose(here.twist, there.twist * twist_signs, atol=1e-9)
    np.testing.assert_allclose(here.belief, there.belief, atol=1e-12)


@QUICK
@given(seed=scenes.seeds)
def test_the_executed_twist_never_jumps(seed: int) -> None:
    """Input across the dead zone, other targets, other methods: the slew limits hold throughout."""
    rng = np.random.default_rng(seed)
    goals, pose, variant = scenes.random_goals(rng, 3, 5), scenes.random_pose(rng), preset()
    state = initial_state(goals, variant)
    dt, previous, direct = 0.01, np.zeros(6), np.zeros(6)
    for tick in range(40):
        if tick % 5 == 0:
            method = str(rng.choice(sorted(METHODS)))
            gain = float(rng.uniform(0.0, 2.0))
            variant = dataclasses.replace(variant, method=method, gain=gain)
            direct = scenes.random_twist(rng) * rng.integers(0, 2) * 2.0
            goals = scenes.random_goals(rng, 3, 5)
        state, step = assist(variant, goals, state, pose, direct, dt)
        change = step.twist - previous
        assert np.linalg.norm(change[:3]) <= variant.max_acceleration * dt + 1e-12
        assert np.linalg.norm(change[3:]) <= variant.max_angular_acceleration * dt + 1e-12
        assert np.linalg.norm(step.twist[:3]) <= variant.max_speed + 1e-12
        assert np.linalg.norm(step.twist[3:]) <= variant.max_angular_speed + 1e-12
        previous, pose = step.twist, moved(pose, step.twist, dt)


def test_ada_limits_nothing() -> None:
    """Under `ada` the executed twist is the one asked for, from the first tick."""
    rng = np.random.default_rng(4)
    goals, variant = scenes.random_goals(rng, 3, 5), preset("ada")
    direct = np.array([3.0, -2.0, 1.0, 4.0, 0.0, 0.0])
    state = initial_state(goals, variant)
    _, step = assist(variant, goals, state, scenes.random_pose(rng), direct, 0.01)
    np.testing.assert_array_equal(step.twist, step.direct + step.assistance)


@QUICK
@given(seed=scenes.seeds, gain=st.floats(0.0, 2.0))
def test_yielding_gives_way_continuously(seed: int, gain: float) -> None:
    """With w_f = ∞ nothing is left against a full push, and no small change of input jumps."""
    rng = np.random.default_rng(seed)
    goals, pose = scenes.random_goals(rng, 3, 1), scenes.random_pose(rng)
    variant = free(method="yielding", gain=gain)
    heading = rng.normal(size=3)
    heading /= np.linalg.norm(heading)
    assume(min(np.linalg.norm(goals.positions - pose.position, axis=1)) > 0.05)
    state = initial_state(goals, variant)
    _, step = assist(variant, goals, state, pose, np.zeros(6), 1e-9)
    direct = np.zeros(6)
    for speed in np.linspace(0.0, 0.06, 601):
        last = step.assistance
        direct = np.concatenate([speed * heading, np.zeros(3)])
        _, step = assist(variant, goals, state, pose, direct, 1e-9)
        # 0.1 mm/s more input: no more than a few times that of assistance
        assert np.linalg.norm(step.assistance[:3] - last[:3]) < 1e-3 * gain + 1e-9
    assert step.assistance[:3] @ heading >= -1e-12
    policy = dataclasses.replace(variant, method="policy")
    _, plain = assist(policy, goals, state, pose, direct, 1e-9)
    np.testing.assert_array_equal(step.assistance[3:], plain.assistance[3:])  # no rotation input
