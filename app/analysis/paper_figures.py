"""The paper's conceptual figures, drawn from the running code and no stored numbers."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from app.analysis.style import LIGHT, figure_style
from app.core import (
    Goals,
    Pose,
    assist,
    counterfactuals,
    initial_state,
    make_goals,
    preset,
    value_slice,
)
from app.core.types import Array

DOWN = np.array([0.0, 1.0, 0.0, 0.0])  # the hand's z axis points at the table
HEIGHT = 0.1  # of every plane drawn [m]
GOAL_COLOURS = (LIGHT["p1"], LIGHT["p2"], LIGHT["p3"])
# one hue, light where the cost-to-go is low
VALUES = LinearSegmentedColormap.from_list("values", ["#f4f9fc", "#7fb7d6", "#1f5f8b", "#0d2a44"])


def draw_paper_figures(out: Path) -> list[Path]:
    """Draw Figures 1–4 and the two ways to take over as PNG and PDF into `out`; return the paths.

    Raises:
        OSError: If the folder cannot be made or written.
    """
    out.mkdir(parents=True, exist_ok=True)
    drawings: dict[str, Callable[[], Figure]] = {
        "figure-1-value": draw_value,
        "figure-2-confidence": draw_confidence,
        "figure-3-belief": draw_belief,
        "figure-4-targets": draw_targets,
        "takeover-both-act": draw_takeover,
    }
    paths = []
    with figure_style():
        for name, draw in drawings.items():
            figure = draw()
            for suffix, metadata in (("png", {"Software": None}), ("pdf", {"CreationDate": None})):
                paths.append(out / f"{name}.{suffix}")
                figure.savefig(paths[-1], metadata=metadata)
    return paths


def draw_value() -> Figure:
    """Figure 1: one goal's value as a heat map; the user's input, the robot's action, x and x'."""
    goals = _point_goals({"canteen": (0.55, 0.12)})
    settings = preset("ada", method="policy")
    position = np.array([0.12, -0.18, HEIGHT])
    direct = np.array([0.12, 0.02, 0.0, 0.0, 0.0, 0.0])
    pose = Pose(position, DOWN)
    _, step = assist(settings, goals, initial_state(goals, settings), pose, direct, 0.1)
    figure = Figure(figsize=(5.2, 4.0), layout="constrained")
    axes = figure.subplots()
    grid = _plane(settings, goals, np.ones(1))
    _heat(figure, axes, grid, "V_g [nat]")
    _goals(axes, goals)
    _hand(axes, position, "x")
    _arrow(axes, position, direct, LIGHT["user"], "D(u)")
    _arrow(axes, position, step.twist, LIGHT["assist"], "a")
    axes.set_title("The value of one goal")
    _hand(axes, position + settings.look_ahead * step.twist[:3], "x'", faint=True)
    _legend(axes, "lower right")
    return figure


def draw_confidence() -> Figure:
    """Figure 2: assistance against confidence, between two goals and behind both."""
    settings = preset("ada", method="policy")
    goals = _point_goals({"one": (0.45, 0.2), "other": (0.45, -0.2)})
    confidences = np.linspace(0.0, 1.0, 41)
    figure = Figure(figsize=(7.2, 5.0), layout="constrained")
    panels = figure.subplots(2, 2, height_ratios=(1.2, 1.0))
    places = (("between both goals", (0.45, 0.0)), ("behind both goals", (0.1, 0.0)))
    for column, (title, (x, y)) in enumerate(places):
        position = np.array([x, y, HEIGHT])
        found = []
        for confidence in confidences:
            belief = np.array([0.5 + 0.5 * confidence, 0.5 - 0.5 * confidence])
            state = initial_state(goals, settings, belief)
            pose = Pose(position, DOWN)
            found.append(counterfactuals(settings, goals, state, pose, np.zeros(6))["policy"])
        twists = 1000.0 * np.array(found)
        top, bottom = panels[0, column], panels[1, column]
        _heat(figure, top, _plane(settings, goals, np.array([0.5, 0.5])), "Σ b V_g [nat]")
        _goals(top, goals)
        _hand(top, position)
        top.set_title(title)
        speed = np.linalg.norm(twists[:, :3], axis=1)
        bottom.plot(confidences, speed, color=LIGHT["assist"], label="speed")
        bottom.plot(confidences, twists[:, 1], "--", color=LIGHT["p1"], label="toward the one")
        bottom.plot(confidences, twists[:, 0], ":", color=LIGHT["p2"], label="forward")
        bottom.set(xlabel="confidence  max p(g) − min p(g)", ylabel="assistance [mm/s]")
        bottom.set_ylim(-3.0, 70.0)
    panels[1, 0].legend(loc="upper left")
    return figure


def draw_belief() -> Figure:
    """Figure 3: belief and value slice with no input, then forward, then left."""
    settings = preset("default", method="policy")
    goals = _point_goals({"canteen": (0.5, 0.22), "block": (0.62, 0.0), "glass": (0.5, -0.22)})
    phases = (("no input", (0.0, 0.0)), ("forward", (0.1, 0.0)), ("left", (0.0, 0.1)))
    state, position = initial_state(goals, settings), np.array([0.05, -0.02, HEIGHT])
    figure = Figure(figsize=(9.6, 4.6), layout="constrained")
    panels = figure.subplots(2, 3, height_ratios=(1.6, 1.0))
    for column, (title, (vx, vy)) in enumerate(phases):
        direct = np.array([vx, vy, 0.0, 0.0, 0.0, 0.0])
        start, step = position.copy(), None
        for _ in range(100):
            state, step = assist(settings, goals, state, Pose(position, DOWN), direct, 0.01)
            position = position + 0.01 * step.twist[:3]
        assert step is not None
        axes, bars = panels[0, column], panels[1, column]
        _heat(figure, axes, _plane(settings, goals, state.belief), "Σ b V_g [nat]", column == 2)
        _goals(axes, goals)
        _hand(axes, start, faint=True)
        _hand(axes, position)
        if np.any(direct):
            _arrow(axes, start, direct, LIGHT["user"], "D(u)")
        _arrow(axes, start, step.twist, LIGHT["assist"], "executed")
        axes.set_title(f"1 s {title}")
        _legend(axes, "lower left")
        bars.bar(goals.names, state.belief, color=GOAL_COLOURS)
        bars.set(ylim=(0.0, 1.0), ylabel="p(g)" if column == 0 else "")
    return figure


def draw_targets() -> Figure:
    """Figure 4: two targets' values, then a goal of 16 targets by its min and soft-min."""
    settings = preset("paper")
    angles = np.arange(16) * (2.0 * np.pi / 16)
    ring = np.stack(
        [0.35 + 0.12 * np.cos(angles), 0.12 * np.sin(angles), np.full(16, HEIGHT)], axis=1
    )
    quaternions = np.tile(DOWN, (16, 1))
    both = make_goals({"ball": (ring, quaternions)})
    single = [make_goals({"one": (ring[[k]], quaternions[[k]])}) for k in (6, 13)]
    figure = Figure(figsize=(10.4, 3.4), layout="constrained")
    panels = figure.subplots(1, 4)
    drawn = (
        ("V_κ, one target", single[0], "min"),
        ("V_κ, another", single[1], "min"),
        ("V_g, min of 16", both, "min"),
        ("V_g, soft-min of 16", both, "soft-min"),
    )
    for axes, (title, goals, kind) in zip(panels, drawn, strict=True):
        _heat(figure, axes, _plane(settings, goals, np.ones(1), kind), "[nat]", place="bottom")
        axes.plot(goals.positions[:, 0], goals.positions[:, 1], ".", ms=4, color=LIGHT["p2"])
        axes.set_title(title)
    return figure


def draw_takeover() -> Figure:
    """Where "both act" differs: assistance against distance, for users who help more or less."""
    figure = Figure(figsize=(5.6, 3.6), layout="constrained")
    axes = figure.subplots()
    goals = _point_goals({"goal": (0.0, 0.0)})
    distances = np.concatenate([np.linspace(0.001, 0.1, 60), np.linspace(0.105, 0.5, 40)])
    variants = [("robot takes over", preset("ada"), "-", LIGHT["m3"])]
    for index, speed in enumerate((0.0, 0.056, 0.15)):
        label = f"both act, user {1000 * speed:.0f} mm/s"
        settings = preset("default", takeover="both-act", user_speed=speed, translation_aside=1.0)
        variants.append((label, settings, ("--", "-.", ":")[index], GOAL_COLOURS[index]))
    for label, settings, style, colour in variants:
        state = initial_state(goals, settings)
        speeds = [
            -1000.0
            * counterfactuals(
                settings, goals, state, Pose(np.array([d, 0.0, HEIGHT]), DOWN), np.zeros(6)
            )["policy"][0]
            for d in distances
        ]
        axes.plot(100.0 * distances, speeds, style, color=colour, label=label)
    axes.set(xlabel="distance to the target [cm]", ylabel="assistance toward it [mm/s]")
    axes.set_ylim(bottom=0.0)
    axes.set_title("Robot takes over, or robot and user both act")
    axes.legend(loc="center right")
    return figure


def _point_goals(places: dict[str, tuple[float, float]]) -> Goals:
    """Return goals with one target each, on the drawn plane, oriented as the hand is."""
    return make_goals({name: ([[x, y, HEIGHT]], [DOWN]) for name, (x, y) in places.items()})


def _plane(settings: object, goals: Goals, belief: Array, kind: str = "min") -> Array:
    """Return V on 0 ≤ x ≤ 0.7, |y| ≤ 0.35, shape (141, 141)."""
    origin, side_x, side_y = (0.0, -0.35, HEIGHT), (0.7, 0.0, 0.0), (0.0, 0.7, 0.0)
    return value_slice(
        settings,  # type: ignore[arg-type]
        goals,
        belief,
        origin,
        side_x,
        side_y,
        (141, 141),
        DOWN,
        kind=kind,  # type: ignore[arg-type]
    )


def _heat(
    figure: Figure, axes: Axes, grid: Array, label: str, bar: bool = True, place: str = "right"
) -> None:
    extent = (0.0, 0.7, -0.35, 0.35)
    image = axes.imshow(
        grid.T, origin="lower", extent=extent, cmap=VALUES, interpolation="bilinear"
    )
    axes.contour(grid.T, levels=8, extent=extent, colors=LIGHT["panel"], linewidths=0.4)
    if bar:
        figure.colorbar(image, ax=axes, label=label, shrink=0.85, location=place)
    axes.grid(visible=False)
    axes.set(xlabel="x [m]", ylabel="y [m]")


def _goals(axes: Axes, goals: Goals) -> None:
    for index, name in enumerate(goals.names):
        x, y, _ = goals.positions[goals.offsets[index]]
        axes.plot(x, y, "o", ms=9, color=GOAL_COLOURS[index], mec=LIGHT["panel"])
        axes.annotate(name, (x, y), (0, 9), textcoords="offset points", ha="center", fontsize=8)


def _hand(axes: Axes, position: Array, name: str = "", faint: bool = False) -> None:
    alpha = 0.45 if faint else 1.0
    axes.plot(*position[:2], "s", ms=7, color=LIGHT["text"], mec=LIGHT["panel"], alpha=alpha)
    if name:
        axes.annotate(
            name,
            (position[0], position[1]),
            (0, -14),
            textcoords="offset points",
            ha="center",
            color=LIGHT["panel"],
        )


def _arrow(axes: Axes, position: Array, twist: Array, colour: str, label: str) -> None:
    axes.quiver(
        *position[:2],
        *twist[:2],
        color=colour,
        label=label,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        width=0.012,
        zorder=5 if label == "D(u)" else 4,
    )


def _legend(axes: Axes, place: Literal["lower left", "lower right"]) -> None:
    """Add a legend that stays readable over a heat map."""
    frame = axes.legend(frameon=True, facecolor=LIGHT["panel"], edgecolor="none", framealpha=0.9)
    frame.set_loc(place)
