"""The three tables of a study (docs/data.md), read tolerantly and typed strictly.

A torn or foreign line costs that line and is said; a missing key column costs the whole table and
is an error that names it.
"""

import csv
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from app.analysis.errors import AnalysisError
from app.analysis.frames import Column, Frame, pd
from app.core.measures import MEASURE_NAMES

KEYS = ("participant_id", "method", "object")
LINK = ("round_trip_ms", "late_share", "blurs", "drops")
NUMERIC = (*MEASURE_NAMES, *LINK, "trial", "attempt", "method_position", "seed", "session")
SURVEY_COLUMNS = ("participant_id", "survey", "shown_as", "method", "item", "value")
TRUE_WORDS = {"true", "1", "1.0", "yes"}


@dataclass(frozen=True)
class StudyData:
    """What a folder holds, before any exclusion.

    Attributes:
        folder: Where it was read from.
        name: The study's name.
        kind: "study", "simulated run" or "sessions".
        trials: One row a trial, columns of docs/data.md.
        participants: One row a participant.
        survey: One row an answer; empty where there was none.
        rules: Exclusion rules of the study file.
        contrast: Reference method and the method held against it, where the study file names them.
        notes: What was missing or torn, in whole sentences.
        calibration: Counts of the belief's calibration that came with the folder, or None.
    """

    folder: Path
    name: str
    kind: str
    trials: Frame
    participants: Frame
    survey: Frame
    rules: tuple[dict[str, Any], ...] = ()
    contrast: tuple[str, str] | None = None
    notes: tuple[str, ...] = ()
    calibration: Frame | None = field(default=None)


def read_table(path: Path, notes: list[str]) -> Frame:
    """Read a CSV as text; lines that are too short or too long are left out and said."""
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise AnalysisError(f"cannot read {path}: {error.strerror}") from None
    rows = list(csv.reader(text.replace("\0", "").splitlines()))
    if not rows:
        notes.append(f"{path.name} is empty.")
        return pd.DataFrame()
    header, body = [name.strip() for name in rows[0]], [row for row in rows[1:] if row]
    whole = [row for row in body if len(row) == len(header)]
    if len(whole) < len(body):
        notes.append(
            f"{path.name}: {len(body) - len(whole)} of {len(body)} lines are torn "
            f"(not {len(header)} fields) and were left out."
        )
    return pd.DataFrame(whole, columns=pd.Index(header)).replace({"n/a": "", "NaN": ""})


def clean_trials(raw: Frame, source: str, notes: list[str]) -> Frame:
    """Type the columns of a trials table; derive `success` and `counted` where they are missing.

    Raises:
        AnalysisError: If there are no rows, or a column without which nothing can be said.
    """
    if raw.empty:
        raise AnalysisError(f"{source} holds no trials: nothing can be analysed")
    missing = [name for name in (*KEYS, "time_s") if name not in raw]
    if "success" not in raw and "outcome" not in raw:
        missing.append("outcome")
    if missing:
        raise AnalysisError(
            f"{source} lacks the columns {', '.join(missing)}; it has {', '.join(raw.columns)}"
        )
    trials = raw.copy()
    for name in KEYS:
        trials[name] = trials[name].fillna("").astype(str).str.strip()
    nameless = (trials["participant_id"] == "") | (trials["method"] == "")
    if nameless.any():
        notes.append(f"{nameless.sum()} rows of {source} name no participant or method: left out.")
        trials = trials[~nameless]
    for name in NUMERIC:
        trials[name] = _to_numbers(trials, name, source, notes)
    if "outcome" not in trials:
        trials["outcome"] = _to_flags(trials["success"]).map({True: "grasped", False: "failed"})
    trials["outcome"] = trials["outcome"].fillna("").astype(str)
    trials["success"] = (
        _to_flags(trials["success"]) if "success" in trials else trials["outcome"] == "grasped"
    )
    for name, default in (("part", "recorded"), ("device", ""), ("options", ""), ("file", "")):
        column = trials[name] if name in trials else pd.Series(default, trials.index)
        trials[name] = column.fillna("").astype(str).replace({"": default})
    if "counted" in trials:
        trials["counted"] = _to_flags(trials["counted"]) & trials["success"]
    else:
        notes.append(f"{source} has no column `counted`: every success outside training counts.")
        trials["counted"] = trials["success"] & (trials["part"] != "training")
    if trials.empty:
        raise AnalysisError(f"{source} holds no usable trial")
    return trials.reset_index(drop=True)


def clean_survey(raw: Frame, notes: list[str]) -> Frame:
    """Type a survey table; answers that are no number are left out and counted."""
    if raw.empty:
        return pd.DataFrame(columns=pd.Index(SURVEY_COLUMNS))
    missing = [name for name in ("participant_id", "item", "value") if name not in raw]
    if missing:
        notes.append(f"The survey table lacks the columns {', '.join(missing)}: left out.")
        return pd.DataFrame(columns=pd.Index(SURVEY_COLUMNS))
    survey = raw.reindex(columns=pd.Index([*SURVEY_COLUMNS])).fillna("").astype(str)
    survey["value"] = pd.to_numeric(survey["value"], errors="coerce")
    dropped = int(survey["value"].isna().sum())
    if dropped:
        notes.append(f"{dropped} survey answers are empty or text and do not enter the statistics.")
    return survey.dropna(subset=["value"]).reset_index(drop=True)


def clean_participants(raw: Frame, ids: Iterable[str], notes: list[str]) -> Frame:
    """One row for every participant who has trials or a line of their own."""
    if raw.empty or "participant_id" not in raw:
        return pd.DataFrame({"participant_id": sorted(set(ids)), "status": "completed"})
    known = raw.fillna("").astype(str).drop_duplicates("participant_id", keep="last")
    lacking = sorted(set(ids) - set(known["participant_id"]))
    if lacking:
        notes.append(f"The participants table lacks {name_some(lacking)}, who have trials.")
        extra = pd.DataFrame({"participant_id": lacking, "status": "completed"})
        known = pd.concat([known, extra], ignore_index=True).fillna("")
    if "status" not in known:
        known["status"] = "completed"
    return known.reset_index(drop=True)


def name_some(names: list[str], most: int = 12) -> str:
    """A list of names for a sentence, cut off with the number of those left out."""
    if len(names) <= most:
        return ", ".join(names)
    return f"{', '.join(names[:most])} and {len(names) - most} more"


def _to_numbers(table: Frame, name: str, source: str, notes: list[str]) -> Column:
    if name not in table:
        return pd.Series(float("nan"), table.index)
    numbers = pd.to_numeric(table[name], errors="coerce")
    if numbers.dtype != "float64":
        numbers = numbers.astype("float64")
    filled = table[name].notna() & (table[name].astype(str).str.strip() != "")
    spoilt = int((numbers.isna() & filled).sum())
    if spoilt and table[name].dtype.kind not in "fiub" and name != "session":
        notes.append(f"{source}: {spoilt} values of {name} are no numbers and count as missing.")
    return numbers.where(numbers.abs() != float("inf"))


def _to_flags(column: Column) -> Column:
    if column.dtype.kind == "b":
        return column.astype(bool)
    return column.fillna("").astype(str).str.strip().str.lower().isin(TRUE_WORDS)
