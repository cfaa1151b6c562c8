"""Figures beyond the paper: feel, inference, calibration, learning, link."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from app.analysis.beyond import Explored, number_trials
from app.analysis.design import order_methods
from app.analysis.frames import Frame
from app.analysis.style import LIGHT, LINE_STYLES, MARKERS, method_colours, note


def draw_explored(explored: list[Explored]) -> Figure:
    """Mean ± SD of each further measure by method, one small panel each."""
    columns = min(3, max(1, len(explored)))
    rows = max(1, -(-len(explored) // columns))
    methods = order_methods({m for e in explored for m in e.means})
    height = 0.34 * max(2, len(methods)) + 0.85
    figure = Figure(figsize=(7.2, rows * height))
    figure.set_layout_engine("constrained", h_pad=0.09)
    grid = np.atleast_1d(figure.subplots(rows, columns, squeeze=False)).ravel()
    colours = method_colours(methods)
    for axes, item in zip(grid, explored, strict=False):
        for i, method in enumerate(methods):
            if method in item.means:
                mean, sd, _ = item.means[method]
                axes.errorbar(
                    mean,
                    -i,
                    xerr=0.0 if np.isnan(sd) else sd,
                    fmt=MARKERS[i % len(MARKERS)],
                    color=colours[method],
                    capsize=3,
                    ms=6,
                )
        axes.margins(x=0.12)
        axes.locator_params(axis="x", nbins=4)
        first = axes in grid[::columns]
        axes.set_yticks([-i for i in range(len(methods))], methods if first else [])
        axes.set_ylim(-len(methods) + 0.4, 0.6)
        axes.set_title(item.label, fontsize=8, fontweight="normal")
        axes.grid(visible=False, axis="y")
    for axes in grid[len(explored) :]:
        axes.set_axis_off()
    return figure


def draw_calibration(table: Frame) -> Figure:
    """Reliability diagram: how often a goal held with a probability was the right one."""
    figure = Figure(figsize=(7.2, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.1, 1])
    left.plot([0, 1], [0, 1], color=LIGHT["edge"], linewidth=1.0, linestyle=":")
    methods = order_methods(set(table["method"]))
    colours = method_colours(methods)
    width = 0.1 * 0.84 / max(1, len(methods))
    for i, method in enumerate(methods):
        rows = table[(table["method"] == method) & (table["count"] > 0)]
        left.plot(
            rows["probability_sum"] / rows["count"],
            rows["hits"] / rows["count"],
            marker=MARKERS[i % len(MARKERS)],
            linestyle=LINE_STYLES[i % len(LINE_STYLES)],
            color=colours[method],
            ms=5,
            label=method,
        )
        share = rows["count"] / rows["count"].sum()
        middle = (rows["low"] + rows["high"]) / 2 + (i - (len(methods) - 1) / 2) * width
        right.bar(middle, share, width, color=colours[method], label=method)
    left.set(xlim=(0, 1), ylim=(0, 1), xlabel="belief in a goal", ylabel="how often it was right")
    left.set_title("Reliability (dotted: perfect)")
    left.legend(loc="upper left")
    right.set(xlim=(0, 1), xlabel="belief in a goal", ylabel="share of forecasts")
    right.set_title("How often each belief was held")
    return figure


def draw_learning(trials: Frame) -> Figure:
    """Time and input against the trial's number within its method, mean ± SE."""
    figure = Figure(figsize=(7.2, 2.9), layout="constrained")
    rows = number_trials(trials)
    for axes, (measure, label) in zip(
        figure.subplots(1, 2),
        (("time_s", "time [s]"), ("input_s", "input [s]")),
        strict=True,
    ):
        _draw_learning(axes, rows, measure, label)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=6)
    return figure


def _draw_learning(axes: Axes, rows: Frame, measure: str, label: str) -> None:
    if rows.empty:
        note(axes, "no counted trial")
        return
    methods = order_methods(set(rows["method"]))
    colours = method_colours(methods)
    table = rows.groupby(["method", "nth"])[measure].agg(["mean", "std", "size"]).reset_index()
    for i, method in enumerate(methods):
        line = table[table["method"] == method]
        se = (line["std"] / line["size"] ** 0.5).fillna(0.0)
        axes.errorbar(
            line["nth"] + 0.04 * (i - (len(methods) - 1) / 2),
            line["mean"],
            se,
            marker=MARKERS[i % len(MARKERS)],
            linestyle=LINE_STYLES[i % len(LINE_STYLES)],
            color=colours[method],
            capsize=3,
            ms=5,
            label=method,
        )
    last = int(rows["nth"].max())
    if last <= 12:
        axes.set_xticks(range(1, last + 1))
    top = (table["mean"] + (table["std"] / table["size"] ** 0.5).fillna(0.0)).max()
    axes.set_ylim(0.0, 1.1 * float(top) if top > 0 else 1.0)
    axes.set_xlabel("counted trial with the method")
    axes.set_ylabel(f"{label}, mean ± SE")


def draw_link(trials: Frame) -> Figure | None:
    """Time against the median round trip, one point a trial; None where it never varies."""
    rows = trials[trials["counted"]].dropna(subset=["round_trip_ms", "time_s"])
    if rows["round_trip_ms"].nunique() < 2:
        return None
    figure = Figure(figsize=(7.2, 2.8), layout="constrained")
    methods = order_methods(set(rows["method"]))
    colours = method_colours(methods)
    for axes, (measure, label) in zip(
        figure.subplots(1, 2),
        (("time_s", "time [s]"), ("input_s", "input [s]")),
        strict=True,
    ):
        for i, method in enumerate(methods):
            line = rows[rows["method"] == method]
            axes.plot(
                line["round_trip_ms"],
                line[measure],
                MARKERS[i % len(MARKERS)],
                color=colours[method],
                ms=4 if len(rows) < 500 else 2.5,
                alpha=0.8 if len(rows) < 500 else 0.35,
                mew=0,
                label=method,
            )
        axes.set(xlabel="median round trip [ms]", ylabel=label)
        axes.legend(loc="upper right")
    return figure
