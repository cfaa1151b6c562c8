"""What the assistance does: along paths, at awkward places, at any size."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import minimize

from app.core import (
    METHODS,
    AssistanceSettings,
    Goals,
    Pose,
    UserInput,
    assist,
    compute_command,
    compute_input,
    counterfactuals,
    initial_state,
    known_goal_twist,
    known_goal_twist_of_step,
    make_goals,
    preset,
)
from app.core.both_act import both_act_values, expected_speeds
from app.core.rotations import approach_axes, from_rotation_vector, multiply, rotation_between
from app.core.types import Array
from app.core.values import rotation_cost, translation_cost, value, weigh

from . import scenes

START = np.array([0.0, 0.0, 0.1])


def push(
    variant: AssistanceSettings, goals: Goals, pushes: list[tuple[Array, float]], rate: float
) -> tuple[Array, list[float]]:
    """Follow scripted inputs with the hand moving by D(u); return the last belief and a history."""
    state, position = initial_state(goals, variant), START.copy()
    history: list[float] = []
    for twist, seconds in pushes:
        for _ in range(round(seconds * rate)):
            state, step = assist(
                variant, goals, state, Pose(position, scenes.IDENTITY), twist, 1.0 / rate
            )
            position = position + twist[:3] / rate
            history.append(float(step.belief[-1]))
    return state.belief, history


def twist(x: float, y: float, z: float = 0.0) -> Array:
    """Return a translation twist."""
    return np.array([x, y, z, 0.0, 0.0, 0.0])


def test_the_belief_does_not_depend_on_the_control_rate() -> None:
    """20, 40, 100 and 250 Hz agree within 0.01 on a scripted path."""
    goals, variant = scenes.three_goals_in_line(), preset("default")
    pushes = [(twist(0.05, 0.0), 0.5), (twist(0.03, 0.03), 0.6), (np.zeros(6), 0.5)]
    beliefs = [push(variant, goals, pushes, rate)[0] for rate in (20.0, 40.0, 100.0, 250.0)]
    spread = np.ptp(np.array(beliefs), axis=0).max()
    assert spread < 0.01
    assert beliefs[0].max() > 0.5  # the path says something


def test_the_belief_turns_round_within_a_second() -> None:
    """After 3 s toward the wrong two of three goals, 1 s toward the third makes it likeliest."""
    goals = make_goals(
        {
            name: (np.array([[x, y, 0.1]]), np.array([scenes.IDENTITY]))
            for name, x, y in (("near", 0.3, -0.2), ("far", 0.5, -0.3), ("other", 0.3, 0.4))
        }
    )
    variant = preset("default")
    wrong, right = twist(0.03, -0.03), twist(0.0, 0.1)
    _, history = push(variant, goals, [(wrong, 3.0), (right, 1.0)], 100.0)
    assert history[299] < 0.02
    assert history[-1] > 0.5
    print(f"\nturned round after {next(i for i, b in enumerate(history[300:]) if b > 0.5) / 100} s")


def test_the_published_predictor_drifts_near_a_target() -> None:
    """With the running cost, no input at all beside a target makes that goal near-certain."""
    goals, position = scenes.three_goals_in_line(), np.array([0.3, 0.0005, 0.1])
    pose = Pose(position, scenes.IDENTITY)
    for name, drifts in (("paper", True), ("ada", True), ("default", False)):
        variant = preset(name)
        state = initial_state(goals, variant)
        for _ in range(60):
            state, step = assist(variant, goals, state, pose, np.zeros(6), 0.025)
        assert (state.belief[1] > 0.95) == drifts


def test_idle_drift_ends_a_stall_and_old_evidence_fades() -> None:
    """η moves the belief toward the goal at hand only while idle; a half-life toward the prior."""
    goals = scenes.three_goals_in_line()
    near = Pose(np.array([0.3, 0.015, 0.1]), scenes.IDENTITY)
    drifting = preset("default", idle_drift=1.0)
    state = initial_state(goals, drifting)
    for _ in range(100):
        state, _ = assist(drifting, goals, state, near, np.zeros(6), 0.01)
    assert state.belief[1] > 0.45
    ageing = preset("default", evidence_half_life=0.5, prior=(0.5, 0.25, 0.25))
    state = initial_state(goals, ageing, [0.1, 0.1, 0.8])
    start = np.log(0.8 / 0.1) - np.log(0.25 / 0.5)
    for _ in range(50):
        state, _ = assist(ageing, goals, state, near, np.zeros(6), 0.01)
    log_odds = state.log_belief[2] - state.log_belief[0] - np.log(0.25 / 0.5)
    assert log_odds == pytest.approx(0.5 * start, rel=1e-9)  # one half-life later


def objective(
    variant: AssistanceSettings, goals: Goals, belief: Array, pose: Pose, direct: Array
) -> tuple[object, Array]:
    """Return s ↦ τ w |s|² + Σ b V_g(y + τ s), written from the formula, and y."""
    tau = variant.look_ahead
    y = pose.position + tau * direct[:3]
    turned = multiply(from_rotation_vector(tau * direct[3:]), pose.quaternion)
    angles, _ = rotation_between(goals.quaternions, turned)
    fixed = variant.rotation_weight * value(angles, rotation_cost(variant))

    def evaluate(s: Array) -> float:
        way = goals.positions - y - tau * s
        along = (way * approach_axes(goals.quaternions)).sum(axis=1)
        squares = (way**2).sum(axis=1) - along**2
        distances = np.sqrt(along**2 + variant.translation_aside**2 * squares)
        least = np.minimum.reduceat(
            value(distances, translation_cost(variant)) + fixed, goals.offsets[:-1]
        )
        return float(tau * variant.w_translation * (s @ s) + belief @ least)

    return evaluate, y


@pytest.mark.parametrize(("w", "aside"), [(20.0, 1.0), (2.0, 1.0), (20.0, 2.0)])
@pytest.mark.parametrize("n_targets", [1, 8])
def test_the_exact_step_minimises_the_objective(w: float, aside: float, n_targets: int) -> None:
    """Against scipy from many starts: the minimiser with one target a goal, else the gap."""
    rng = np.random.default_rng(7)
    gaps, misses, first_order = [], [], []
    for _ in range(12):
        goals, pose = scenes.random_goals(rng, 3, n_targets), scenes.random_pose(rng)
        belief, direct = rng.dirichlet(np.ones(3)), scenes.random_twist(rng, rotating=False)
        variant = preset("ada", method="policy", step="exact", w_translation=w)
        variant = dataclasses.replace(variant, translation_aside=aside)
        state = initial_state(goals, variant, belief)
        asked = counterfactuals(variant, goals, state, pose, direct)["policy"]
        plain = dataclasses.replace(variant, step="first-order")
        first = counterfactuals(plain, goals, state, pose, direct)["policy"]
        of, y = objective(variant, goals, belief, pose, direct)
        found = (asked - direct)[:3]
        starts = [found, np.zeros(3), *((goals.positions - y) * 9.0)]
        ends = [
            minimize(of, s, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-14})  # type: ignore[call-overload]
            for s in starts
        ]
        best = min(ends, key=lambda end: end.fun)
        gaps.append(of(found) - best.fun)  # type: ignore[operator]
        misses.append(float(np.linalg.norm(found - best.x)))
        first_order.append(float(np.linalg.norm((first - asked)[:3])))
    print(
        f"\nw = {w}, {n_targets} targets: objective gap ≤ {max(gaps):.2e} nat, minimiser within "
        f"{1000 * max(misses):.3f} mm/s; first order within {1000 * max(first_order):.1f} mm/s"
    )
    assert max(gaps) < 1e-9 if n_targets == 1 else max(gaps) < 2e-3
    if n_targets == 1:
        assert max(misses) < 1e-4


@pytest.mark.parametrize("method", sorted(METHODS))
@pytest.mark.parametrize("changes", [{}, {"step": "exact"}, {"takeover": "both-act"}])
def test_every_place_gives_finite_numbers(method: str, changes: dict[str, str]) -> None:
    """At a target exactly, half a turn away from it, very far, and beside it by a hair."""
    goals = make_goals(
        {"a": ([[0.3, 0.0, 0.1]], [[1, 0, 0, 0]]), "b": ([[9, 9, 9]], [[0, 1, 0, 0]])}
    )
    places = [
        Pose(np.array([0.3, 0.0, 0.1]), np.array([1.0, 0.0, 0.0, 0.0])),
        Pose(np.array([0.3, 0.0, 0.1]), np.array([0.0, 0.0, 0.0, 1.0])),
        Pose(np.array([0.3, 1e-300, 0.1]), np.array([-1.0, 1e-200, 0.0, 0.0])),
        Pose(np.array([1e6, -1e6, 1e6]), np.array([0.5, 0.5, -0.5, -0.5])),
    ]
    for name in ("default", "ada", "paper"):
        variant = preset(name, method=method, **changes)
        state = initial_state(goals, variant)
        for pose in places:
            for direct in (np.zeros(6), twist(0.1, 0.0)):
                state, step = assist(variant, goals, state, pose, direct, 0.01)
                found = [getattr(step, field.name) for field in dataclasses.fields(step)]
                arrays = [one for one in found if isinstance(one, np.ndarray)]
                assert len(arrays) == 7
                assert all(np.isfinite(one).all() for one in arrays)
                assert np.linalg.norm(step.assistance) < 30.0


@pytest.mark.parametrize("shape", [(1, 1), (1, 500), (100, 30)])
def test_any_number_of_goals_and_targets(shape: tuple[int, int]) -> None:
    """1 goal, 100 goals, a goal with 500 targets: beliefs sum to one, V is the least over κ."""
    rng = np.random.default_rng(2)
    goals, pose, variant = scenes.random_goals(rng, *shape), scenes.random_pose(rng), preset()
    state = initial_state(goals, variant)
    for _ in range(20):
        state, _ = assist(variant, goals, state, pose, twist(0.1, 0.05), 0.01)
    _, step = assist(variant, goals, state, pose, twist(0.1, 0.05), 0.01)
    angles, _ = rotation_between(goals.quaternions, pose.quaternion)
    axes = approach_axes(goals.quaternions)
    way = weigh(goals.positions - pose.position, axes, variant.translation_aside)
    distances = np.linalg.norm(way, axis=1)
    all_values = value(distances, translation_cost(variant))
    all_values += variant.rotation_weight * value(angles, rotation_cost(variant))
    np.testing.assert_allclose(step.values, all_values.reshape(shape).min(axis=1), atol=1e-12)
    assert step.belief.sum() == pytest.approx(1.0, abs=1e-12)
    assert (
        (goals.offsets[:-1] <= step.best_targets) & (step.best_targets < goals.offsets[1:])
    ).all()


def test_counterfactuals_are_what_assist_would_have_asked_for() -> None:
    """For its own method, and for every other; certainty gives the known-goal twist."""
    rng = np.random.default_rng(11)
    goals, pose = scenes.random_goals(rng, 3, 6), scenes.random_pose(rng)
    direct = scenes.random_twist(rng)
    for method in METHODS:
        variant = preset("default", method=method)
        before = initial_state(goals, variant)
        after, step = assist(variant, goals, before, pose, direct, 0.01)
        would = counterfactuals(variant, goals, after, pose, direct)
        assert set(would) == set(METHODS)
        np.testing.assert_allclose(would[method], step.direct + step.assistance, atol=1e-15)
        certain = initial_state(goals, variant, [0.0, 1.0, 0.0])
        expected = counterfactuals(variant, goals, certain, pose, direct)[method]
        known = known_goal_twist(variant, goals, after, pose, direct, goals.names[1])
        np.testing.assert_allclose(known, expected, atol=1e-12)
        of_step = known_goal_twist_of_step(variant, step, goals.names[1])
        np.testing.assert_allclose(of_step, known, atol=1e-15)
        off = dataclasses.replace(variant, enabled=False)
        _, still = assist(off, goals, before, pose, direct, 0.01)
        assert not still.assistance.any()
        np.testing.assert_array_equal(still.belief, step.belief)


def test_both_acting_adds_less_the_more_the_user_does() -> None:
    """V^both rises with distance; its slope is the robot's charge; a helping user lowers both."""
    speeds = (0.0, 0.1, 0.2)
    found = [both_act_values(preset(takeover="both-act", user_speed=s)) for s in speeds]
    for distances, values in found:
        assert (np.diff(values) > 0.0).all()
        assert values[0] == 0.0
        assert distances[0] == 0.0
    lone, some, most = (values[-1] for _, values in found)
    assert lone > some > most
    # nobody helps: V' = 2 w s with s = √(C/w), the optimal control of C + w s²
    variant = preset(takeover="both-act", user_speed=0.0)
    _, _, robot = expected_speeds(found[0][0], variant)
    slope = (found[0][1][-1] - found[0][1][-4]) / (found[0][0][-1] - found[0][0][-4])
    assert slope == pytest.approx(2.0 * variant.w_translation * robot[-1], rel=0.01)
    goals, pose = scenes.three_goals_in_line(), Pose(START, scenes.IDENTITY)
    asked = []
    for speed in speeds:
        variant = preset(takeover="both-act", user_speed=speed, method="policy")
        state = initial_state(goals, variant)
        asked.append(counterfactuals(variant, goals, state, pose, np.zeros(6))["policy"][0])
    assert asked[0] > asked[1] > asked[2] > 0.0


def test_the_sticks_command_the_hand() -> None:
    """Right stick: the table's plane, as the view sees it; left: the height; round dead zones."""
    speeds = preset("default")
    away = UserInput(axes=(0.0, 0.0, 0.0, 1.0), dead_zone=0.0)
    np.testing.assert_allclose(compute_command(away, speeds), twist(0.2, 0.0), atol=1e-15)
    turned = dataclasses.replace(away, view_yaw=math.pi / 2)
    np.testing.assert_allclose(compute_command(turned, speeds), twist(0.0, 0.2), atol=1e-15)
    right = UserInput(axes=(0.0, 0.0, 1.0, 0.0), dead_zone=0.0)
    np.testing.assert_allclose(compute_command(right, speeds), twist(0.0, -0.2), atol=1e-15)
    up = UserInput(axes=(0.0, 1.0, 0.0, 0.0), dead_zone=0.0)
    np.testing.assert_allclose(compute_command(up, speeds), twist(0.0, 0.0, 0.2), atol=1e-15)
    inside = UserInput(axes=(0.05, 0.05, 0.05, -0.08), dead_zone=0.1)
    np.testing.assert_array_equal(compute_input(inside), np.zeros(6))
    half = UserInput(axes=(0.0, 0.0, 0.0, 0.55), dead_zone=0.1)
    assert compute_input(half)[0] == pytest.approx(0.5)
    tilt = UserInput(axes=(0.0, 0.0, 0.0, 1.0), dead_zone=0.0, mode="rotate")
    rotation = compute_command(tilt, speeds)
    # pushing away tips the hand's top away: ω × z = x
    np.testing.assert_allclose(np.cross(rotation[3:], [0, 0, 1]), [0.4, 0.0, 0.0], atol=1e-15)
    yaw = UserInput(axes=(1.0, 0.0, 0.0, 0.0), dead_zone=0.0, mode="rotate")
    np.testing.assert_allclose(compute_command(yaw, speeds)[3:], [0.0, 0.0, -0.4], atol=1e-15)
