"""The answer of a study: means by method, and ratios of means with their intervals.

Means are over a method's successful trials, and its failures stand beside them. Ratios are over the
pairs that both methods completed: mean of one / mean of the other; the interval is a bootstrap over
users, each with all of their trials, because one user's trials resemble each other.
"""

import math
from collections import Counter
from collections.abc import Sequence
from itertools import permutations
from typing import Any

import numpy as np

from app.core.measures import MEASURE_NAMES
from app.core.types import Array
from app.simulate.plan import Study
from app.simulate.store import calibration_table
from app.simulate.trial import Row

DRAWS = 4000
"""Bootstrap samples."""
RATIO_MEASURES = {"time": "time_s", "input": "input_s"}
Interval = list[float | None]
"""Estimate, low and high end of the 95 % interval; None where undefined."""


def summarise(study: Study, rows: Sequence[Row]) -> dict[str, Any]:
    """The study as JSON values: methods, ratios, calibration, config."""
    names = [method.name for method in study.methods]
    by_method = {name: [row for row in rows if row["method"] == name] for name in names}
    return {
        "methods": {name: _means(by_method[name]) for name in names},
        "ratios": {
            f"{above}/{below}": ratio(by_method[above], by_method[below])
            for above, below in permutations(names, 2)
        },
        "calibration": _calibration(rows),
        "config": study.to_dict(),
    }


def ratio(above: Sequence[Row], below: Sequence[Row]) -> dict[str, Any]:
    """Ratio of means over pairs that both completed, with failures of both beside it."""
    other = {_key(row): row for row in below}
    both = [(a, other[_key(a)]) for a in above if _key(a) in other]
    pairs = [(a, b) for a, b in both if a["success"] and b["success"]]
    result: dict[str, Any] = {
        name: _interval(pairs, column) for name, column in RATIO_MEASURES.items()
    }
    result["pairs"] = len(pairs)
    result["failures"] = [
        sum(not a["success"] for a, _ in both),
        sum(not b["success"] for _, b in both),
    ]
    return result


def _key(row: Row) -> tuple[str, int]:
    return row["participant_id"], row["trial"]


def _interval(pairs: Sequence[tuple[Row, Row]], column: str) -> Interval:
    users = sorted({a["participant_id"] for a, _ in pairs})
    number = {user: i for i, user in enumerate(users)}
    sums = np.zeros((len(users), 2))
    for a, b in pairs:
        sums[number[a["participant_id"]]] += a[column], b[column]
    if not len(users) or sums[:, 1].sum() <= 0.0:
        return [None, None, None]
    estimate = float(sums[:, 0].sum() / sums[:, 1].sum())
    if len(users) < 2:
        return [estimate, None, None]
    low, high = _bootstrap(sums)
    return [estimate, low, high]


def _bootstrap(sums: Array) -> tuple[float, float]:
    """Percentile interval of Σ above / Σ below over resampled users, sums of shape (n, 2)."""
    n = len(sums)
    counts = np.random.default_rng(0).multinomial(n, np.full(n, 1.0 / n), size=DRAWS)
    drawn = counts @ sums
    ratios = drawn[drawn[:, 1] > 0.0]
    low, high = np.percentile(ratios[:, 0] / ratios[:, 1], [2.5, 97.5])
    return float(low), float(high)


def _means(rows: Sequence[Row]) -> dict[str, Any]:
    succeeded = [row for row in rows if row["success"]]
    outcomes = Counter(row["outcome"] for row in rows)
    return {
        "trials": len(rows),
        "success": len(succeeded) / len(rows) if rows else None,
        **{name: _mean(succeeded, name) for name in MEASURE_NAMES},
        "failures": {k: n for k, n in sorted(outcomes.items()) if k != "grasped"},
    }


def _mean(rows: Sequence[Row], name: str) -> float | None:
    values = [row[name] for row in rows if row[name] is not None]
    return math.fsum(values) / len(values) if values else None


def _calibration(rows: Sequence[Row]) -> dict[str, list[dict[str, float]]]:
    """Per method the bins of probability that occurred: mean forecast, observed share, count."""
    found: dict[str, list[dict[str, float]]] = {}
    for method, _, _, count, total, hits in calibration_table(rows):
        if count:
            entry = {"forecast": total / count, "observed": hits / count, "count": count}
            found.setdefault(method, []).append(entry)
    return found
