"""Tables of the report as files: CSV for every table, one JSON for all numbers."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

from app.analysis.frames import Frame, pandas, pd
from app.analysis.results import Results


def result_tables(results: Results) -> dict[str, Frame]:
    """File stem → table, with plain column names and full precision."""
    tables: dict[str, Frame] = {
        "exclusions": _records(results.exclusions, ["participant_id", "reason", "rule"]),
        "outcomes": results.outcomes,
        "time": results.cells["time_s"],
        "input": results.cells["input_s"],
        "anova": pd.DataFrame(
            [
                {"measure": a.measure, "factors": a.factors, "n": a.n, **vars(effect)}
                for a in results.anovas
                for effect in a.effects
            ]
        ),
        "pairs": pd.DataFrame(
            [
                {
                    "measure": p.measure,
                    "reference": p.reference,
                    "method": p.method,
                    **{f"difference_{k}": v for k, v in vars(p.difference).items()},
                    **{f"ratio_{k}": v for k, v in vars(p.ratio).items()},
                    "p_adjusted": p.adjusted,
                }
                for p in results.pairs
            ]
        ),
        "mixed": _records(results.mixed),
        "explored": pd.DataFrame(
            [
                {"measure": e.measure, "method": m, "mean": mean, "sd": sd, "n": n}
                for e in results.explored
                for m, (mean, sd, n) in e.means.items()
            ]
        ),
        "learning": _records(results.trends),
        "link": _records(results.links),
    }
    if results.survey_means is not None:
        tables["survey"] = results.survey_means
    if results.calibration is not None:
        tables["calibration"] = results.calibration
    for factor in results.factors:
        tables[f"factor-{''.join(c if c.isalnum() else '-' for c in factor.name)}"] = factor.means
    return {name: table for name, table in tables.items() if len(table) or name == "exclusions"}


def write_tables(results: Results, folder: Path) -> list[str]:
    """Write every table as CSV and all results as results.json; returns the file names."""
    names = []
    for name, table in result_tables(results).items():
        table.to_csv(folder / f"{name}.csv", index=False)
        names.append(f"{name}.csv")
    document = {
        "study": results.data.name,
        "kind": results.data.kind,
        "participants": results.participants,
        "methods": results.methods,
        "contrast": results.contrast,
        "hypotheses": results.hypotheses,
        "carryover": results.carryover,
        "survey_items": results.items,
        "explored": results.explored,
        "anova": results.anovas,
        "notes": results.notes,
        "tables": result_tables(results),
    }
    text = json.dumps(to_plain(document), indent=1, ensure_ascii=False, allow_nan=False)
    (folder / "results.json").write_text(text + "\n", encoding="utf-8")
    return [*names, "results.json"]


def to_plain(value: Any) -> Any:
    """Anything of ours as what JSON holds; NaN and infinity become null."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = [field.name for field in dataclasses.fields(value)]
        return {name: to_plain(getattr(value, name)) for name in names}
    if isinstance(value, pandas.DataFrame):
        return to_plain(value.to_dict("records"))
    if isinstance(value, dict):
        return {str(k): to_plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | set):
        return [to_plain(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def _records(items: list[Any], columns: list[str] | None = None) -> Frame:
    return pd.DataFrame([to_plain(i) for i in items], columns=columns)
