"""`hindsight bench`: every figure of this machine in one run, as a table or JSON."""

import sys
from collections.abc import Sequence
from typing import Any

Figures = dict[str, dict[str, Any]]


def bench(
    what: str,
    *,
    sessions: Sequence[int] = (),
    seconds: float = 15.0,
    minutes: float | None = None,
    keep: bool = False,
) -> Figures:
    """Run the benches; names map to {median, p99, unit}, for others as their docstrings say.

    The browser's latency is left out, with a line saying so, where there is no browser.

    Args:
        what: "all", "assist", "simulate", "review", "capacity" or "soak".
        sessions: Sessions at once, for capacity and soak; empty: their own choice.
        seconds: How long capacity tries each number [s].
        minutes: How long the soak runs, or the reviewed trial is; None: 60, or 10.
        keep: Whether the measured capacity is kept for servers on this machine.

    Raises:
        AppError: If a number is out of range, or a session did not survive its bench.
    """
    if what == "assist":
        from app.bench.assist import bench_assist

        return bench_assist()
    if what == "simulate":
        from app.bench.simulate import bench_simulate

        return bench_simulate()
    if what == "review":
        from app.bench.review import bench_review

        return bench_review(minutes or 10.0)
    if what == "capacity":
        from app.bench.capacity import SIZES, bench_capacity

        return bench_capacity(sessions or SIZES, seconds, keep=keep)
    if what == "soak":
        from app.bench.soak import bench_soak

        return bench_soak(minutes or 60.0, sessions[0] if sessions else 4)
    from app.bench.latency import bench_latency
    from app.bench.loop import bench_loop
    from app.bench.record import bench_record
    from app.bench.scene import bench_scene

    figures: Figures = {}
    for part in (bench_loop, bench_record, bench_scene, bench_latency):
        print(f"{part.__name__.removeprefix('bench_')} …", file=sys.stderr, flush=True)
        figures |= part()
    return figures


def format_table(figures: Figures) -> str:
    """The figures as aligned text, one a line."""
    names = list(figures)
    columns = list(dict.fromkeys(key for figure in figures.values() for key in figure))
    rows = [["name", *columns]]
    rows += [[name, *(_cell(figures[name].get(key, "")) for key in columns)] for name in names]
    widths = [max(len(row[i]) for row in rows) for i in range(len(columns) + 1)]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
