"""Measures of hand-made trials whose values can be counted on the fingers."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.core.measures import (
    MEASURE_NAMES,
    Measures,
    calibration_counts,
    compute_measures,
)

DT = 0.01


def make_columns(n: int, **changes: object) -> dict[str, np.ndarray]:
    """Make n running ticks: the user pushes half way along x, the hand follows exactly."""
    direct = np.zeros((n, 6))
    direct[:, 0] = 0.1
    columns: dict[str, np.ndarray] = {
        "phase": np.full(n, "running"),
        "input_norm": np.full(n, 0.5),
        "direct_twist": direct,
        "assistance_twist": np.zeros((n, 6)),
        "executed_twist": direct.copy(),
        "belief": np.full((n, 2), 0.5),
    }
    return columns | {name: np.asarray(value) for name, value in changes.items()}


def test_a_hand_that_follows_is_fully_felt() -> None:
    """Following exactly: cosine 1, nothing opposed, no idle or wrong-way motion, no cancelling."""
    m = compute_measures(make_columns(200), true_goal=0, dt=DT)
    assert m.time_s == pytest.approx(2.0)
    assert m.input_s == pytest.approx(1.0)
    assert m.felt_control == pytest.approx(1.0)
    assert (m.opposed, m.idle_motion, m.wrong_way_m) == (0.0, 0.0, 0.0)
    assert math.isnan(m.cancel_s)


def test_only_the_running_phase_counts() -> None:
    """The wait before the start signal and the automatic lift are not the user's time."""
    phase = ["ready"] * 50 + ["running"] * 100 + ["closing"] * 30 + ["lifting"] * 20
    m = compute_measures(make_columns(200, phase=phase), true_goal=0, dt=DT)
    assert m.time_s == pytest.approx(1.0)
    assert m.input_s == pytest.approx(0.5)


def test_no_push_leaves_what_needs_a_push_undefined() -> None:
    """An idle user: no cosine, no opposition; all motion of the hand is idle motion."""
    executed = np.zeros((100, 6))
    executed[:25, 2] = 0.05
    columns = make_columns(
        100,
        input_norm=np.zeros(100),
        direct_twist=np.zeros((100, 6)),
        executed_twist=executed,
    )
    m = compute_measures(columns, true_goal=0, dt=DT)
    assert m.input_s == 0.0
    assert m.idle_motion == 1.0
    assert all(math.isnan(v) for v in (m.felt_control, m.opposed, m.wrong_way_m, m.cancel_s))


def test_felt_control_is_weighted_by_the_push() -> None:
    """A full push that is obeyed outweighs a quarter push that is turned round: (1 − .25)/1.25."""
    n = 100
    norm = np.where(np.arange(n) < 50, 1.0, 0.25)
    executed = np.zeros((n, 6))
    executed[:50, 0], executed[50:, 0] = 0.1, -0.1
    m = compute_measures(
        make_columns(n, input_norm=norm, executed_twist=executed), true_goal=0, dt=DT
    )
    assert m.felt_control == pytest.approx(0.75 / 1.25)


def test_rotation_that_the_user_did_not_command_does_not_dilute_control() -> None:
    """While translating, the wrist turning by itself is assistance, not disobedience."""
    executed = np.zeros((10, 6))
    executed[:, 0], executed[:, 5] = 0.1, 1.0
    m = compute_measures(make_columns(10, executed_twist=executed), true_goal=0, dt=DT)
    assert m.felt_control == pytest.approx(1.0)


def test_opposition_and_wrong_way_path() -> None:
    """A quarter of the push against 3 cm/s of assistance; the hand goes back 2 cm/s for 0.5 s."""
    n = 200
    assistance, executed = np.zeros((n, 6)), np.zeros((n, 6))
    assistance[:50, 0] = -0.03
    executed[:, 0] = 0.05
    executed[:50] = [-0.02, 0.07, 0.0, 0.0, 0.0, 0.0]
    m = compute_measures(
        make_columns(n, assistance_twist=assistance, executed_twist=executed), true_goal=0, dt=DT
    )
    assert m.opposed == pytest.approx(0.25)
    assert m.wrong_way_m == pytest.approx(0.02 * 0.5)
    assert m.cancel_s == pytest.approx(0.5)


def test_cancelling_counts_only_pushes_that_win() -> None:
    """Runs of 20 ticks (won), 10 ticks (released) and 30 ticks (trial ends): mean of the first."""
    n = 100
    executed = make_columns(n)["executed_twist"]
    norm = np.full(n, 0.5)
    executed[10:30, 0] = executed[40:50, 0] = executed[70:, 0] = -0.1
    norm[50:60] = 0.0
    m = compute_measures(
        make_columns(n, input_norm=norm, executed_twist=executed), true_goal=0, dt=DT
    )
    assert m.cancel_s == pytest.approx(0.2)


def test_belief_measures_of_a_belief_that_turns_round() -> None:
    """Wrong and confident for 1 s, tied for 0.5 s, then right: leads for good from 1.5 s on."""
    belief = np.array([[0.1, 0.9]] * 100 + [[0.5, 0.5]] * 50 + [[0.8, 0.2]] * 50)
    m = compute_measures(make_columns(200, belief=belief), true_goal=0, dt=DT)
    assert m.correct_s == pytest.approx(1.5)
    assert m.wrong_confident_s == pytest.approx(1.0)
    expected = -(100 * math.log(0.1) + 50 * math.log(0.5) + 50 * math.log(0.8)) / 200
    assert m.log_loss == pytest.approx(expected)
    assert m.brier == pytest.approx((100 * 1.62 + 50 * 0.5 + 50 * 0.08) / 200)


def test_a_goal_that_never_leads_has_no_time_of_inference() -> None:
    """Undefined is not zero; a goal outside the model has no likelihood at all."""
    belief = np.array([[0.1, 0.9]] * 10)
    m = compute_measures(make_columns(10, belief=belief), true_goal=0, dt=DT)
    assert math.isnan(m.correct_s)
    unmodelled = compute_measures(make_columns(10, belief=belief), true_goal=None, dt=DT)
    assert unmodelled.wrong_confident_s == pytest.approx(0.1)
    assert math.isnan(unmodelled.log_loss) and math.isnan(unmodelled.correct_s)


def test_a_trial_without_running_ticks_is_zero_long_and_otherwise_undefined() -> None:
    """A trial that was aborted before the start signal does not break the table."""
    m = compute_measures(make_columns(5, phase=["ready"] * 5), true_goal=0, dt=DT)
    assert (m.time_s, m.input_s) == (0.0, 0.0)
    assert math.isnan(m.felt_control) and math.isnan(m.log_loss) and math.isnan(m.idle_motion)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60))
def test_measures_stay_in_their_ranges(seed: int, n: int) -> None:
    """Whatever the trial, shares lie in [0, 1], cosines in [−1, 1], and paths are not negative."""
    rng = np.random.default_rng(seed)
    columns = make_columns(
        n,
        input_norm=rng.choice([0.0, 0.3, 1.4], n),
        assistance_twist=rng.normal(size=(n, 6)),
        executed_twist=rng.normal(size=(n, 6)),
        belief=rng.dirichlet(np.ones(3), n),
    )
    columns["direct_twist"] = rng.normal(size=(n, 6)) * (columns["input_norm"] > 0)[:, None]
    m = compute_measures(columns, true_goal=1, dt=DT)
    for low, value, high in (
        (-1.0, m.felt_control, 1.0),
        (0.0, m.opposed, 1.0),
        (0.0, m.idle_motion, 1.0),
        (0.0, m.wrong_way_m, 10.0 * n * DT),
        (0.0, m.cancel_s, n * DT),
        (0.0, m.correct_s, n * DT),
        (0.0, m.brier, 2.0),
    ):
        assert math.isnan(value) or low - 1e-9 <= value <= high + 1e-9


def test_calibration_counts_add_up() -> None:
    """Two goals over four ticks are eight forecasts; certainty falls into the last bin."""
    belief = np.array([[0.25, 0.75], [0.25, 0.75], [0.25, 0.75], [0.0, 1.0]])
    counts, sums, hits = calibration_counts(belief, true_goal=1, n_bins=4)
    assert counts.tolist() == [1.0, 3.0, 0.0, 4.0]
    assert sums == pytest.approx([0.0, 0.75, 0.0, 3.25])
    assert hits.tolist() == [0.0, 0.0, 0.0, 4.0]


def test_names_are_those_of_the_trials_table() -> None:
    """The table's columns are the fields, in order."""
    values = compute_measures(make_columns(3), true_goal=0, dt=DT).to_dict()
    assert tuple(values) == MEASURE_NAMES == tuple(Measures.__dataclass_fields__)
