"""Power and sweeps: the published numbers, and responses that are known."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from statsmodels.stats.power import TTestPower

from app.analysis.errors import AnalysisError
from app.analysis.power import (
    format_plan,
    plan_for_differences,
    plan_for_effect,
    power_of,
    required_participants,
    resampled_power,
    safeguard_effect,
)
from app.analysis.power_command import plan_from_folder
from app.analysis.sweep import load_sweep, run_sweep, summarise_sweep
from app.analysis.sweep_figure import draw_sweep
from tests.analysis.synthetic import make_study


@pytest.mark.parametrize(("dz", "n80", "n90"), [(1.14, 9, 11), (0.88, 13, 16)])
def test_participants_for_the_papers_effects(dz: float, n80: int, n90: int) -> None:
    """Time and input of the paper: 9 and 11, 13 and 16 participants for 80 and 90 % power."""
    assert required_participants(dz, 0.8) == n80
    assert required_participants(dz, 0.9) == n90


@pytest.mark.parametrize(("dz", "n"), [(0.3, 20), (0.5, 34), (-0.5, 34), (1.2, 5), (0.05, 400)])
def test_power_agrees_with_statsmodels(dz: float, n: int) -> None:
    """A second implementation of the noncentral t."""
    assert power_of(dz, n) == pytest.approx(TTestPower().power(abs(dz), n, 0.05), abs=1e-9)


def test_the_number_is_the_smallest_that_suffices() -> None:
    """One participant fewer has too little power."""
    for dz in (0.2, 0.35, 0.8):
        n = required_participants(dz)
        assert n is not None
        assert power_of(dz, n) >= 0.8 > power_of(dz, n - 1)


def test_the_safeguard_plans_with_less_than_was_measured() -> None:
    """Lower end of the 60 % interval; an interval that holds 0 leaves nothing to plan with."""
    assert 0.6 < safeguard_effect(1.14, 10) < 1.14
    assert safeguard_effect(0.1, 5) == 0.0
    plan = plan_for_effect(0.1, n_observed=5, powers=(0.8,))
    assert plan.needed_safeguard == {0.8: None}
    assert "no number of" in format_plan(plan)


def test_resampled_power_agrees_with_the_formula_for_normal_data() -> None:
    """Normal differences of dz 0.8: studies drawn from them reach the formula's power."""
    z = np.random.default_rng(4).normal(size=4000)
    d = (z - z.mean()) / z.std(ddof=1) + 0.8
    assert resampled_power(d, 15) == pytest.approx(power_of(0.8, 15), abs=0.03)
    assert plan_for_differences(d[:200], label="x").simulated


def test_impossible_plans_say_why() -> None:
    """No effect, no power, no data."""
    with pytest.raises(AnalysisError, match="dz = 0"):
        required_participants(0.0)
    with pytest.raises(AnalysisError, match="between 0 and 1"):
        required_participants(0.5, power=1.0)
    with pytest.raises(AnalysisError, match="at least 3"):
        plan_for_differences(np.array([1.0, 2.0]), label="time")


def test_a_plan_from_a_folder(tmp_path: Path) -> None:
    """Both measures of a study, its methods found; a method that is not there is named."""
    folder = make_study(tmp_path, n=8)
    plans = plan_from_folder(folder)
    assert [p.label for p in plans] == ["time: blend − policy", "input: blend − policy"]
    assert all(p.n_observed == 8 and p.safeguard < p.dz for p in plans)
    with pytest.raises(AnalysisError, match="yielding"):
        plan_from_folder(folder, contrast=("blend", "yielding"))


SWEEP = """
name: gain
base: {methods: [blend, policy], trials: 4}
vary:
  - {parameter: settings.gain, from: 0.5, to: 2.0, count: 3, scale: log}
  - {parameter: user.style, values: [continue, lazy]}
design: DESIGN
measures: [time_s, success]
"""


def write_sweep(tmp_path: Path, design: str = "grid") -> Path:
    """A sweep's file."""
    path = tmp_path / "SWEEP.yaml"
    path.write_text(SWEEP.replace("DESIGN", design))
    return path


def run_study(config: dict[str, Any]) -> pd.DataFrame:
    """Time is 10 / gain, twice that for blend; the last user fails."""
    gain = config["parameters"].get("settings.gain", 1.0)
    rows = [
        {
            "participant_id": f"u{i}",
            "method": method,
            "time_s": 10.0 / gain * (2 if method == "blend" else 1),
            "success": i < 3,
        }
        for i in range(config["trials"])
        for method in config["methods"]
    ]
    return pd.DataFrame(rows)


def test_a_grid_visits_every_combination_and_finds_the_response(tmp_path: Path) -> None:
    """3 × 2 points; the mean at each gain is the response that was put in."""
    sweep = load_sweep(write_sweep(tmp_path))
    assert len(sweep.points()) == 6
    assert sweep.vary[0].levels() == [0.5, 1.0, 2.0]
    told: list[str] = []
    rows = run_sweep(sweep, run_study, told.append)
    assert len(told) == 6 and "settings.gain = 0.5" in told[0]
    table = summarise_sweep(rows, sweep).set_index(["parameter", "level", "method", "measure"])
    assert table.loc[("settings.gain", 0.5, "policy", "time_s"), "mean"] == pytest.approx(20.0)
    assert table.loc[("settings.gain", 2.0, "blend", "time_s"), "mean"] == pytest.approx(10.0)
    assert table.loc[("user.style", "lazy", "blend", "success"), "mean"] == pytest.approx(0.75)
    files = draw_sweep(rows, sweep, tmp_path / "out")
    assert all(path.stat().st_size > 100 for path in files)


def test_one_at_a_time_keeps_the_others_at_base(tmp_path: Path) -> None:
    """3 + 2 points, each naming one parameter only."""
    sweep = load_sweep(write_sweep(tmp_path, "one-at-a-time"))
    assert [len(point) for point in sweep.points()] == [1] * 5
    table = summarise_sweep(run_sweep(sweep, run_study), sweep)
    styles = table[(table["parameter"] == "user.style") & (table["measure"] == "time_s")]
    assert sorted(styles["mean"]) == pytest.approx([10.0, 10.0, 20.0, 20.0])
    assert not math.isnan(styles["se"].sum())


def test_a_sweep_against_a_method_gives_ratios(tmp_path: Path) -> None:
    """Blend takes twice as long as policy at every gain; a method that was not run is named."""
    path = write_sweep(tmp_path)
    path.write_text(path.read_text() + "\nagainst: blend\nmarks: {time_s: 1.55}\n")
    sweep = load_sweep(path)
    rows = run_sweep(sweep, run_study)
    table = summarise_sweep(rows, sweep)
    times = table[table["measure"] == "time_s"]
    assert set(times["method"]) == {"policy"}
    assert times["mean"].to_numpy() == pytest.approx(2.0)
    assert times["se"].to_numpy() == pytest.approx(0.0)
    assert all(path.stat().st_size > 100 for path in draw_sweep(rows, sweep, tmp_path / "out"))
    with pytest.raises(AnalysisError, match="autonomy.*blend, policy"):
        summarise_sweep(rows, sweep.model_copy(update={"against": "autonomy"}))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("time_s, success", "speed", "speed.*valid are"),
        ("values: [continue, lazy]", "count: 3", "either values, or both from and to"),
        ("user.style", "settings.gain", "varied twice"),
        ("design: grid", "design: random", "grid"),
        ("from: 0.5", "from: 0", "above 0"),
        ("name: gain", "nome: gain", "nome"),
        ("vary:", "vary: [", "cannot be read"),
    ],
)
def test_a_malformed_sweep_names_field_and_valid_values(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    """Before anything runs."""
    path = write_sweep(tmp_path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(AnalysisError, match=said):
        load_sweep(path)
