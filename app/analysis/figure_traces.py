"""The paper's figures 8 and 9: what user and assistance did, along the time of chosen trials."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from app.analysis.frames import Frame
from app.analysis.style import LIGHT
from app.core.types import Array
from app.recording.errors import RecordingError
from app.recording.reader import read_trial

AXES = ("X (away)", "Y (left)", "Z (up)")
COLUMNS = (
    "phase",
    "time_s",
    "direct_twist",
    "assistance_twist",
    "known_goal_assistance_twist",
)


@dataclass(frozen=True)
class Trace:
    """One trial's velocities over the running phase.

    Attributes:
        method: Method of the trial.
        time_s: [s], shape (n,).
        user: Velocity part of D(u) [m/s], shape (n, 3).
        assistance: What the method adds under its belief [m/s], shape (n, 3).
        known: What it would have added had the goal been known [m/s], shape (n, 3).
    """

    method: str
    time_s: Array
    user: Array
    assistance: Array
    known: Array


@dataclass(frozen=True)
class Chosen:
    """A participant and an object whose trials are drawn side by side, and why."""

    participant_id: str
    object: str
    files: tuple[str, ...]
    reason: str


def choose_traces(trials: Frame, survey: Frame, contrast: tuple[str, str]) -> list[Chosen]:
    """As the paper: who preferred the method most, and who preferred the reference most.

    Without preferences: who gained most time, and who lost most (or gained least). Of each person
    the object with the largest difference in time. Trials without logs cannot be drawn.
    """
    reference, method = contrast
    rows = trials[trials["counted"] & (trials["file"] != "") & trials["method"].isin(contrast)]
    rows = rows.drop_duplicates(["participant_id", "object", "method"], keep="last")
    times = rows.pivot(index=["participant_id", "object"], columns="method", values="time_s")
    files = rows.pivot(index=["participant_id", "object"], columns="method", values="file")
    if not set(contrast) <= set(times.columns):
        return []
    gain = (times[reference] - times[method]).dropna()
    if gain.empty:
        return []
    best = gain.groupby(level=0).max()
    prefer = survey[survey["item"] == "prefer"].groupby("participant_id")["value"].mean()
    prefer = prefer[prefer.index.isin(best.index)]
    if len(prefer) and prefer.max() > prefer.min():
        pairs = [
            (prefer.idxmax(), f"preferred {method} most ({prefer.max():g} of 7)"),
            (prefer.idxmin(), f"preferred {reference} most ({prefer.min():g} of 7)"),
        ]
    else:
        pairs = [
            (best.idxmax(), f"gained most time with {method} ({best.max():.1f} s)"),
            (best.idxmin(), f"gained least time with {method} ({best.min():.1f} s)"),
        ]
    chosen = []
    for participant, reason in dict(pairs).items():
        thing = gain.loc[participant].idxmax()
        paths = tuple(str(files.loc[(participant, thing), m]) for m in contrast)
        chosen.append(Chosen(str(participant), str(thing), paths, reason))
    return chosen


def read_trace(path: Path) -> Trace | None:
    """The running phase of a log; None where the log cannot be read or is empty."""
    try:
        log = read_trial(path, columns=COLUMNS)
    except (RecordingError, OSError):
        return None
    running = log.steps["phase"] == "running"
    if running.sum() < 2:
        return None
    columns = {name: log.steps[name][running] for name in COLUMNS[1:]}
    return Trace(
        log.header.method,
        columns["time_s"],
        columns["direct_twist"][:, :3],
        columns["assistance_twist"][:, :3],
        columns["known_goal_assistance_twist"][:, :3],
    )


def draw_traces(traces: list[Trace]) -> Figure:
    """One column a trial: three dimensions, then the dot product of user and assistance."""
    figure = Figure(figsize=(7.2, 6.4), layout="constrained")
    grid = figure.subplots(4, len(traces), squeeze=False, sharey="row")
    for column, trace in enumerate(traces):
        grid[0][column].set_title(trace.method)
        for i in range(3):
            _draw_dimension(grid[i][column], trace, i)
            grid[i][column].tick_params(labelbottom=False)
        _draw_agreement(grid[3][column], trace)
        grid[3][column].set_xlabel("time [s]")
    for i in range(3):
        grid[i][0].set_ylabel(f"{AXES[i]}\n[cm/s]")
    grid[3][0].set_ylabel("user · assistance\n[(cm/s)²]")
    handles, labels = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def _draw_dimension(axes: Axes, trace: Trace, i: int) -> None:
    axes.axhline(0.0, color=LIGHT["edge"], linewidth=0.8)
    axes.plot(trace.time_s, 100 * trace.user[:, i], color=LIGHT["user"], label="user input D(u)")
    axes.plot(
        trace.time_s,
        100 * trace.assistance[:, i],
        color=LIGHT["assist"],
        linestyle="--",
        label="assistance − user input, by belief",
    )
    axes.plot(
        trace.time_s,
        100 * trace.known[:, i],
        color=LIGHT["text-3"],
        linestyle=":",
        label="… had the goal been known",
    )


def _draw_agreement(axes: Axes, trace: Trace) -> None:
    """D(u) · assistance: below 0 the user works against it."""
    axes.axhline(0.0, color=LIGHT["edge"], linewidth=0.8)
    for assistance, colour, style in (
        (trace.assistance, LIGHT["assist"], "--"),
        (trace.known, LIGHT["text-3"], ":"),
    ):
        product = 1e4 * np.einsum("ij,ij->i", trace.user, assistance)
        axes.plot(trace.time_s, product, color=colour, linestyle=style)
