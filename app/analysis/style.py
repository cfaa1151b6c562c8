"""How figures look: the tokens of the page, embedded fonts, one drawing for light and dark.

A figure is drawn in the light tokens. For the report its SVG has every token's colour replaced by a
CSS variable, so that the same drawing follows the reader's theme; PDF and PNG stay light.
"""

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import matplotlib
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

TOKENS: dict[str, tuple[str, str]] = {
    "panel": ("#ffffff", "#171c22"),
    "line": ("#d3d9df", "#303a45"),
    "edge": ("#84909c", "#637180"),
    "text": ("#14191f", "#eef1f4"),
    "text-2": ("#3f4a55", "#b9c3cd"),
    "text-3": ("#5b6773", "#8e9aa6"),
    "user": ("#6a5b00", "#f0e442"),
    "assist": ("#c2489a", "#f98cb9"),
    "ok": ("#0b7a45", "#7fd6a4"),
    "warn": ("#8a5a00", "#f2b84b"),
    "bad": ("#b8321a", "#ff8a70"),
    "m1": ("#5b6774", "#9aa6b2"),
    "m2": ("#33438d", "#8b9cf0"),
    "m3": ("#1080ae", "#4fb6e6"),
    "m4": ("#b25a1c", "#f0a064"),
    "m5": ("#7a3f8f", "#cf9be0"),
    "m6": ("#2c7d5b", "#7fd0ac"),
    "p1": ("#0072b2", "#56a9e0"),
    "p2": ("#d55e01", "#ff9a4d"),
    "p3": ("#009e74", "#3ccba3"),
    "p4": ("#b04a86", "#e392c3"),
    "p5": ("#9a7400", "#e0b84a"),
    "p6": ("#4b5563", "#aab4c0"),
    "p7": ("#2b9bd0", "#8fd3ff"),
    "p8": ("#6f4fb0", "#b9a2f0"),
}
"""Name → (light, dark). All light values differ, so that each can be found again in the SVG. m1–m6
are methods, p1–p8 participants; every one also differs by marker, hatch or label."""

LIGHT = {name: light for name, (light, _) in TOKENS.items()}
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
METHOD_TOKENS = {"direct": "m1", "blend": "m2", "policy": "m3", "yielding": "m4", "autonomy": "m5"}
LINE_STYLES = ("-", "--", "-.", ":")
MANY = 64
"""Participants up to whom each has a hue and marker of their own."""


def method_colours(methods: Sequence[str]) -> dict[str, str]:
    """A colour per method; known methods keep theirs, others take what is free."""
    chosen: dict[str, str] = {}
    free = [t for t in ("m6", "m5", "m4", "m1", "m3", "m2")]
    for method in methods:
        token = METHOD_TOKENS.get(method)
        if token is None or LIGHT[token] in chosen.values():
            left = [t for t in free if LIGHT[t] not in chosen.values()]
            token = left[0] if left else "m1"
        chosen[method] = LIGHT[token]
    return chosen


def participant_styles(participants: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Colour and marker per participant, the same in every figure; one for all beyond 64."""
    if len(participants) > MANY:
        return {p: (LIGHT["p1"], "o") for p in participants}
    return {
        p: (LIGHT[f"p{i % 8 + 1}"], MARKERS[i // 8 % len(MARKERS)])
        for i, p in enumerate(participants)
    }


@contextmanager
def figure_style() -> Iterator[None]:
    """Matplotlib settings while figures are drawn; no window system is touched."""
    settings = {
        "backend": "agg",
        "font.family": ["DejaVu Sans"],
        "font.size": 9,
        "axes.titlesize": 9.5,
        "axes.titleweight": "bold",
        "axes.titlelocation": "left",
        "axes.labelsize": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.edgecolor": LIGHT["edge"],
        "axes.labelcolor": LIGHT["text-2"],
        "axes.titlecolor": LIGHT["text"],
        "axes.facecolor": "none",
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": LIGHT["line"],
        "grid.linewidth": 0.6,
        "xtick.color": LIGHT["edge"],
        "ytick.color": LIGHT["edge"],
        "xtick.labelcolor": LIGHT["text-2"],
        "ytick.labelcolor": LIGHT["text-2"],
        "text.color": LIGHT["text"],
        "figure.facecolor": LIGHT["panel"],
        "legend.frameon": False,
        "legend.fontsize": 8,
        "lines.linewidth": 1.6,
        "hatch.linewidth": 0.6,
        "pdf.fonttype": 42,
        "ps.fonttype": 42,
        "svg.fonttype": "path",
        "svg.hashsalt": "hindsight",
        "figure.dpi": 100,
        "savefig.dpi": 200,
    }
    with rc_context(cast(Any, settings)):
        yield


def save(figure: Figure, folder: Path, name: str) -> str:
    """Write PDF and PNG; return the SVG whose colours follow the reader's theme."""
    figure.savefig(folder / f"{name}.pdf", metadata={"CreationDate": None})
    figure.set_layout_engine("none")  # it is laid out; doing it again costs half the time
    figure.savefig(folder / f"{name}.png", metadata={"Software": None})
    with matplotlib.rc_context({"svg.hashsalt": f"hindsight-{name}"}):
        stream = io.StringIO()
        figure.savefig(stream, format="svg", transparent=True, metadata={"Date": None})
    return _themed(stream.getvalue(), name)


def _themed(svg: str, name: str) -> str:
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    # Ids are per figure: glyphs and markers of two drawings on one page must not meet.
    svg = re.sub(r'(id="|href="#|url\(#)', rf"\g<1>{name}-", svg)
    by_light = {light: token for token, (light, _) in TOKENS.items()}
    return re.sub(
        r"#[0-9a-f]{6}\b",
        lambda m: f"var(--{by_light[m[0]]})" if m[0] in by_light else m[0],
        svg,
    )


def note(axes: Axes, text: str) -> None:
    """Say why there is nothing to see, in the middle of the axes."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", wrap=True)
    axes.grid(visible=False)
