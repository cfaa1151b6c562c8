"""Who does not enter the analysis: why, and by which rule of the study file.

A rule is a mapping of one name to one value, e.g. `{max_failed: 3}`. Besides the named rules any
column of the participants table serves: `{prior_exposure: yes}` or `{device: [keyboard, none]}`
excludes those whose entry equals a value.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from app.analysis.errors import AnalysisError
from app.analysis.frames import Frame
from app.analysis.tables import StudyData

Reasons = dict[str, str]
"""Participant → why the rule excludes them."""


@dataclass(frozen=True)
class Exclusion:
    """One participant left out by one rule."""

    participant_id: str
    reason: str
    rule: str


def find_exclusions(data: StudyData) -> list[Exclusion]:
    """Apply the status column and every rule of the study file; the first that holds is named.

    Raises:
        AnalysisError: If a rule is unknown or its value of the wrong kind.
    """
    found: dict[str, Exclusion] = {}
    for reasons, rule in [(_by_status(data.participants), "status"), *_by_rules(data)]:
        for participant, reason in sorted(reasons.items()):
            found.setdefault(participant, Exclusion(participant, reason, rule))
    return sorted(found.values(), key=lambda e: e.participant_id)


def _by_status(participants: Frame) -> Reasons:
    reasons: Reasons = {}
    for row in participants.to_dict("records"):
        status = str(row["status"]).strip().lower()
        if status in ("", "completed"):
            continue
        why = {
            "withdrawn": "withdrew",
            "excluded": "excluded by the experimenter",
            "running": "has not finished",
        }.get(status, f"status is {status!r}")
        by = str(row.get("excluded_by", "") or "").strip()
        reasons[str(row["participant_id"])] = f"{why}: {by}" if by else why
    return reasons


def _by_rules(data: StudyData) -> list[tuple[Reasons, str]]:
    results = []
    for rule in data.rules:
        for name, value in rule.items():
            text = f"{name}: {value}"
            if name in _RULES:
                results.append((_RULES[name](data.trials, _number(name, value)), text))
            elif name == "device" or name in data.participants:
                results.append((_by_column(data, name, value), text))
            else:
                raise AnalysisError(
                    f"unknown exclusion rule {name!r}; valid are {', '.join(_RULES)}, device and "
                    f"the columns of the participants table: {', '.join(data.participants.columns)}"
                )
    return results


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise AnalysisError(f"exclusion rule {name} needs a number, not {value!r}")
    return float(value)


def _by_column(data: StudyData, name: str, value: Any) -> Reasons:
    unwanted = [str(v).lower() for v in (value if isinstance(value, list | tuple) else [value])]
    # YAML reads a bare yes or no as a truth value.
    unwanted += [{"true": "yes", "false": "no"}[v] for v in unwanted if v in ("true", "false")]
    table = data.participants if name in data.participants else data.trials
    pairs = table[["participant_id", name]].drop_duplicates().itertuples(index=False)
    return {
        str(participant): f"{name} is {entry}"
        for participant, entry in pairs
        if str(entry).strip().lower() in unwanted
    }


def _recorded(trials: Frame) -> Frame:
    return trials[trials["part"] != "training"]


def _max_failed(trials: Frame, limit: float) -> Reasons:
    failed = _recorded(trials)[lambda t: ~t["success"]].groupby("participant_id").size()
    return {str(p): f"{n} failed trials" for p, n in failed.items() if n > limit}


def _min_counted(trials: Frame, limit: float) -> Reasons:
    counts = trials.groupby("participant_id")["counted"].sum()
    return {str(p): f"{n} counted trials" for p, n in counts.items() if n < limit}


def _min_counted_per_method(trials: Frame, limit: float) -> Reasons:
    counts = trials.pivot_table(
        index="participant_id", columns="method", values="counted", aggfunc="sum", fill_value=0
    )
    reasons: Reasons = {}
    used = [m for m in counts.columns if trials.loc[trials["method"] == m, "counted"].any()]
    for method in used or list(counts.columns):
        for participant, n in counts[method].items():
            if n < limit:
                reasons.setdefault(str(participant), f"{int(n)} counted trials with {method}")
    return reasons


def _max_sum(column: str, unit: str) -> Callable[[Frame, float], Reasons]:
    def rule(trials: Frame, limit: float) -> Reasons:
        sums = _recorded(trials).groupby("participant_id")[column].sum()
        return {str(p): f"{n:g} {unit}" for p, n in sums.items() if n > limit}

    return rule


def _max_median(column: str, unit: str) -> Callable[[Frame, float], Reasons]:
    def rule(trials: Frame, limit: float) -> Reasons:
        medians = _recorded(trials).groupby("participant_id")[column].median()
        return {str(p): f"median {column} {n:.3g}{unit}" for p, n in medians.items() if n > limit}

    return rule


_RULES: dict[str, Callable[[Frame, float], Reasons]] = {
    "max_failed": _max_failed,
    "min_counted": _min_counted,
    "min_counted_per_method": _min_counted_per_method,
    "max_blurs": _max_sum("blurs", "times left the window"),
    "max_drops": _max_sum("drops", "lost connections"),
    "max_round_trip_ms": _max_median("round_trip_ms", " ms"),
    "max_late_share": _max_median("late_share", ""),
}
RULE_NAMES = tuple(_RULES)
