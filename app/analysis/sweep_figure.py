"""The response of the measures to the parameters of a sweep, drawn and written."""

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from app.analysis.design import order_methods
from app.analysis.frames import Frame
from app.analysis.style import LINE_STYLES, MARKERS, figure_style, method_colours, save
from app.analysis.sweep import Sweep, Varied, summarise_sweep

LABELS = {
    "time_s": "time [s]",
    "input_s": "input [s]",
    "felt_control": "felt control",
    "wrong_way_m": "wrong-way motion [m]",
    "cancel_s": "cancel time [s]",
    "correct_s": "correct inference [s]",
    "wrong_confident_s": "confident, wrong [s]",
    "log_loss": "log-loss [nat]",
    "success": "success",
}


def draw_sweep(rows: Frame, sweep: Sweep, folder: Path) -> list[Path]:
    """Draw measures against parameters; write PDF, PNG, and the numbers as CSV.

    Args:
        rows: What `run_sweep` returned.
        sweep: The same sweep.
        folder: Where to; made if missing.

    Returns:
        The files: sweep.pdf, sweep.png, sweep.csv.
    """
    folder.mkdir(parents=True, exist_ok=True)
    table = summarise_sweep(rows, sweep)
    table.to_csv(folder / "sweep.csv", index=False)
    n_rows, n_columns = len(sweep.measures), len(sweep.vary)
    with figure_style():
        figure = Figure(
            figsize=(max(4.2, 3.4 * n_columns), 0.8 + 1.9 * n_rows), layout="constrained"
        )
        grid = figure.subplots(n_rows, n_columns, squeeze=False, sharey="row", sharex="col")
        for i, measure in enumerate(sweep.measures):
            for k, varied in enumerate(sweep.vary):
                chosen = (table["measure"] == measure) & (table["parameter"] == varied.parameter)
                _draw_response(grid[i][k], table[chosen], varied)
                if measure in sweep.marks:
                    grid[i][k].axhline(sweep.marks[measure], color="0.5", lw=1, ls=":")
            label = LABELS.get(measure, measure)
            if sweep.against is not None:
                label = f"{label.split(' [')[0]}: {sweep.against} ÷ method"
            grid[i][0].set_ylabel(label)
        for k, varied in enumerate(sweep.vary):
            grid[-1][k].set_xlabel(varied.parameter)
        handles, labels = grid[0][0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=min(5, len(labels)))
        save(figure, folder, "sweep")
    return [folder / f"sweep.{ending}" for ending in ("pdf", "png", "csv")]


def _draw_response(axes: Axes, table: Frame, varied: Varied) -> None:
    """One line a method, mean ± SE; words stand in their order."""
    levels = varied.levels()
    words = not all(isinstance(v, int | float) and not isinstance(v, bool) for v in levels)
    methods = order_methods(set(table["method"]))
    colours = method_colours(methods)
    for i, method in enumerate(methods):
        line = table[table["method"] == method].set_index("level").reindex(levels)
        axes.errorbar(
            range(len(levels)) if words else levels,
            line["mean"],
            line["se"].fillna(0.0),
            marker=MARKERS[i % len(MARKERS)],
            linestyle=LINE_STYLES[i % len(LINE_STYLES)],
            color=colours[method],
            capsize=3,
            ms=5,
            label=method,
        )
    if words:
        axes.set_xticks(range(len(levels)), [str(v) for v in levels], rotation=20)
    elif varied.scale == "log":
        axes.set_xscale("log")
