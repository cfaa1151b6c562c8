"""Means, ratios over pairs, and their intervals by user."""

from typing import Any

import numpy as np
import pytest

from app.core.measures import MEASURE_NAMES
from app.simulate.plan import make_study
from app.simulate.summary import ratio, summarise

Row = dict[str, Any]


def row(method: str, user: int, trial: int, time_s: float, success: bool = True) -> Row:
    """A row of the trials table, as far as summaries read it."""
    return dict.fromkeys(MEASURE_NAMES) | {
        "participant_id": f"user-{user:04d}",
        "trial": trial,
        "method": method,
        "method_position": 1 if method == "blend" else 2,
        "outcome": "grasped" if success else "timeout",
        "success": success,
        "time_s": time_s,
        "input_s": time_s / 4,
    }


def test_ratios_are_of_means_over_pairs_that_both_completed():
    """(10 + 6) / (4 + 4); the failed pair is left out and counted."""
    blend = [row("blend", 1, 1, 10.0), row("blend", 1, 2, 6.0), row("blend", 2, 1, 100.0, False)]
    policy = [row("policy", 1, 1, 4.0), row("policy", 1, 2, 4.0), row("policy", 2, 1, 1.0)]
    found = ratio(blend, policy)
    assert found["time"][0] == pytest.approx(2.0)
    assert found["input"][0] == pytest.approx(2.0)
    assert (found["pairs"], found["failures"]) == (2, [1, 0])


def test_intervals_are_of_users_not_of_trials():
    """Forty trials of four users leave a wider interval than forty of forty."""
    rng = np.random.default_rng(3)

    def interval(users: int) -> float:
        each = 40 // users
        factor = np.exp(rng.normal(0.0, 0.4, users))
        above = [row("blend", u, t, 8.0 * factor[u]) for u in range(users) for t in range(each)]
        below = [row("policy", u, t, 4.0) for u in range(users) for t in range(each)]
        estimate, low, high = ratio(above, below)["time"]
        assert low < estimate < high
        return high - low

    assert np.mean([interval(4) for _ in range(20)]) > 1.7 * np.mean(
        [interval(40) for _ in range(20)]
    )


def test_an_interval_needs_two_users_and_a_ratio_a_pair():
    """None where there is nothing to say, never a made-up number."""
    assert ratio([row("blend", 1, 1, 2.0)], [row("policy", 1, 1, 1.0)])["time"] == [2.0, None, None]
    assert ratio([row("blend", 1, 1, 2.0, False)], [row("policy", 1, 1, 1.0)])["time"] == [None] * 3


def test_the_summary_has_means_failures_and_every_ratio():
    """Means are of successes; ratios stand in both directions."""
    study = make_study(methods="blend,policy", trials=2)
    rows = [
        row("blend", 1, 1, 10.0),
        row("blend", 1, 2, 60.0, False),
        row("policy", 1, 1, 5.0),
        row("policy", 1, 2, 5.0),
    ]
    summary = summarise(study, rows)
    blend = summary["methods"]["blend"]
    assert (blend["trials"], blend["success"], blend["time_s"]) == (2, 0.5, 10.0)
    assert blend["failures"] == {"timeout": 1}
    assert blend["felt_control"] is None
    assert set(summary["ratios"]) == {"blend/policy", "policy/blend"}
    product = (
        summary["ratios"]["blend/policy"]["time"][0]
        * (summary["ratios"]["policy/blend"]["time"][0])
    )
    assert product == pytest.approx(1.0)
