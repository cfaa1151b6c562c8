"""`hindsight simulate power`: plan from a folder of trials, or from an effect."""

from pathlib import Path

from app.analysis.design import choose_contrast, make_cells, order_methods
from app.analysis.errors import AnalysisError
from app.analysis.exclusions import find_exclusions
from app.analysis.load import Progress, load
from app.analysis.power import PowerPlan, plan_for_differences

LABELS = {"time_s": "time", "input_s": "input"}


def plan_from_folder(
    folder: Path,
    progress: Progress = lambda text: None,
    *,
    contrast: tuple[str, str] | None = None,
    powers: tuple[float, ...] = (0.8, 0.9),
    alpha: float = 0.05,
) -> list[PowerPlan]:
    """Plans for time and input from the participants (or simulated users) of a folder.

    Raises:
        AnalysisError: If the folder cannot be read, or there are no two methods to compare.
    """
    data = load(folder, progress)
    out = {e.participant_id for e in find_exclusions(data)}
    trials = data.trials[~data.trials["participant_id"].isin(out)]
    methods = order_methods(set(trials.loc[trials["counted"], "method"]))
    if contrast is not None and not set(contrast) <= set(methods):
        raise AnalysisError(
            f"no counted trials with {' and '.join(contrast)}; there are {', '.join(methods)}"
        )
    pair = contrast or choose_contrast(methods, data.contrast)
    if pair is None:
        raise AnalysisError(f"{folder}: counted trials of {len(methods)} methods; 2 are needed")
    plans = []
    for measure, label in LABELS.items():
        _, means = make_cells(trials, measure).of_methods(*pair).balanced_means()
        plans.append(
            plan_for_differences(
                means[:, 0] - means[:, 1],
                label=f"{label}: {pair[0]} − {pair[1]}",
                powers=powers,
                alpha=alpha,
            )
        )
    return plans
