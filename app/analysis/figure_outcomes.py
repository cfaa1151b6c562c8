"""The paper's figures 6 and 7, redrawn from a study's tables."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from app.analysis.design import make_cells, order_methods
from app.analysis.frames import Frame
from app.analysis.hypotheses import NEUTRAL, answers
from app.analysis.style import LIGHT, MANY, method_colours, note, participant_styles
from app.analysis.summaries import cell_table, survey_table

LABELS = {"time_s": "time [s]", "input_s": "input [s]"}
HATCHES = ("", "///", "...", "xxx", "\\\\\\", "ooo")


def draw_time_and_input(
    trials: Frame, participants: list[str], contrast: tuple[str, str] | None
) -> Figure:
    """Figure 6: means with standard errors; per-trial difference against the reference's value."""
    figure = Figure(figsize=(7.2, 5.6), layout="constrained")
    grid = figure.subplots(2, 2, width_ratios=[1, 1.7])
    styles = participant_styles(participants)
    for row, measure in enumerate(("time_s", "input_s")):
        _draw_means(grid[row][0], trials, measure)
        if contrast is None:
            note(grid[row][1], "needs two methods")
        else:
            _draw_differences(grid[row][1], trials, measure, contrast, styles)
    return figure


def _draw_means(axes: Axes, trials: Frame, measure: str) -> None:
    """Bars of participants' means with SE; every participant as a dot where there are few."""
    table = cell_table(trials, measure)
    total = table[table["object"] == "all"]
    methods = list(total["method"])
    if not methods:
        note(axes, "no counted trial")
        return
    colours = method_colours(methods)
    for i, (method, mean, se) in enumerate(zip(methods, total["mean"], total["se"], strict=True)):
        axes.bar(
            i,
            mean,
            width=0.62,
            color=colours[method],
            edgecolor=LIGHT["panel"],
            hatch=HATCHES[i % len(HATCHES)],
        )
        if np.isfinite(se):
            axes.errorbar(i, mean, se, color=LIGHT["text"], capsize=4, linewidth=1.2)
    axes.set_xticks(range(len(methods)), [m.replace(":", ":\n") for m in methods])
    if len(methods) > 3:
        axes.tick_params(axis="x", labelrotation=30)
    axes.set_ylabel(LABELS.get(measure, measure))
    axes.set_title("Mean ± SE over participants")
    axes.grid(visible=False, axis="x")


def _draw_differences(
    axes: Axes,
    trials: Frame,
    measure: str,
    contrast: tuple[str, str],
    styles: dict[str, tuple[str, str]],
) -> None:
    """Reference minus method against the reference, one point per participant and object."""
    reference, method = contrast
    cells = make_cells(trials, measure)
    if not set(contrast) <= set(cells.methods):
        note(axes, f"needs counted trials of {reference} and {method}")
        return
    pair = cells.of_methods(*contrast)
    x, other = pair.means[:, 0], pair.means[:, 1]
    y = x - other
    axes.axhline(0.0, color=LIGHT["edge"], linewidth=1.0)
    if len(styles) > MANY:
        kept = np.isfinite(y)
        axes.plot(x[kept], y[kept], "o", ms=2.5, alpha=0.35, color=LIGHT["p1"], mew=0)
    else:
        for i, participant in enumerate(pair.participants):
            colour, marker = styles.get(participant, (LIGHT["p1"], "o"))
            kept = np.isfinite(y[i])
            axes.plot(
                x[i][kept], y[i][kept], marker, color=colour, ms=5.5, mec=LIGHT["panel"], mew=0.6
            )
    unit = LABELS.get(measure, measure)
    axes.set_xlabel(f"{reference}: {unit}")
    axes.set_ylabel(f"{reference} − {method}: {unit}")
    axes.set_title(f"Above 0: {method} needed less")


def draw_survey(survey: Frame, participants: list[str], contrast: tuple[str, str] | None) -> Figure:
    """Figure 7: item means with standard errors; difference in `like` against `prefer`."""
    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.5, 1])
    _draw_items(left, survey)
    if contrast is None:
        note(right, "needs two methods")
    else:
        _draw_like_against_prefer(right, survey, participant_styles(participants), contrast)
    return figure


def _draw_items(axes: Axes, survey: Frame) -> None:
    table = survey_table(survey)
    items = list(dict.fromkeys(table["item"]))
    methods = order_methods({m for m in table["method"] if m})
    colours = method_colours(methods)
    width = 0.8 / max(1, len(methods))
    for i, method in enumerate(methods):
        rows = table[table["method"] == method].set_index("item").reindex(items)
        x = np.arange(len(items)) + (i - (len(methods) - 1) / 2) * width
        axes.bar(
            x,
            rows["mean"],
            width * 0.94,
            color=colours[method],
            edgecolor=LIGHT["panel"],
            hatch=HATCHES[i % len(HATCHES)],
            label=method,
        )
        axes.errorbar(
            x, rows["mean"], rows["se"].fillna(0.0), fmt="none", ecolor=LIGHT["text"], capsize=3
        )
    alone = table[table["method"] == ""].set_index("item").reindex(items)
    x = np.arange(len(items))
    axes.bar(x, alone["mean"], 0.44, color=LIGHT["m1"], edgecolor=LIGHT["panel"])
    axes.errorbar(
        x, alone["mean"], alone["se"].fillna(0.0), fmt="none", ecolor=LIGHT["text"], capsize=3
    )
    axes.axhline(NEUTRAL, color=LIGHT["edge"], linewidth=1.0, linestyle=":")
    axes.set_xticks(x, items, rotation=0 if len(items) <= 6 else 35, ha="center")
    low, high = _scale(survey)
    axes.set_ylim(low, high + 0.12 * (high - low))
    axes.set_ylabel("answer, mean ± SE")
    if methods:
        axes.legend(ncols=len(methods), loc="upper left", borderaxespad=0.1)
    axes.grid(visible=False, axis="x")


def _scale(survey: Frame) -> tuple[float, float]:
    """Ends of the scale: 1 to 7 unless answers lie outside."""
    return min(1.0, float(survey["value"].min())), max(7.0, float(survey["value"].max()))


def _draw_like_against_prefer(
    axes: Axes, survey: Frame, styles: dict[str, tuple[str, str]], contrast: tuple[str, str]
) -> None:
    reference, method = contrast
    like = answers(survey, "like").reindex(columns=list(contrast))
    prefer = survey[survey["item"] == "prefer"].groupby("participant_id")["value"].mean()
    both = (like[method] - like[reference]).to_frame("like").join(prefer.rename("prefer")).dropna()
    if both.empty:
        note(axes, "nobody answered both\n'like' and 'prefer'")
        return
    axes.axhline(0.0, color=LIGHT["edge"], linewidth=1.0)
    axes.axvline(NEUTRAL, color=LIGHT["edge"], linewidth=1.0)
    reach = max(1.5, float(both["like"].abs().max()) + 0.6)
    axes.set_ylim(-reach, reach)
    axes.set_xlim(0.5, 7.5)
    axes.set_xticks(range(1, 8))
    axes.set_xlabel(f"prefer: 1 {reference} … 7 {method}")
    axes.set_ylabel(f"like: {method} − {reference}")
    if len(styles) > MANY:  # rings would meet: the area of a disc tells how many
        counts = both.groupby(["prefer", "like"]).size().reset_index(name="n")
        area = 300.0 * counts["n"] / counts["n"].max()
        axes.scatter(counts["prefer"], counts["like"], area, color=LIGHT["p1"], alpha=0.8, lw=0)
        return
    # Points on one coordinate stand around it in rings, as in the paper.
    order = both.groupby(["prefer", "like"]).cumcount().to_numpy()
    size = both.groupby(["prefer", "like"])["like"].transform("size").to_numpy()
    radius = np.where(size > 1, 0.16 * np.sqrt(np.ceil(size / 8)), 0.0)
    x = both["prefer"] + radius * np.cos(2 * np.pi * order / size)
    y = both["like"] + radius * np.sin(2 * np.pi * order / size)
    for participant, px, py in zip(both.index, x, y, strict=True):
        colour, marker = styles.get(str(participant), (LIGHT["p1"], "o"))
        axes.plot(px, py, marker, color=colour, ms=6, mec=LIGHT["panel"], mew=0.6)
