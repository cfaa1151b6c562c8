"""The summary as text, and progress on a terminal."""

import math
import sys
import time
from typing import Any

_SHOWN = (
    "time_s",
    "input_s",
    "felt_control",
    "opposed",
    "idle_motion",
    "wrong_way_m",
    "cancel_s",
    "correct_s",
    "wrong_confident_s",
    "log_loss",
)


def format_summary(summary: dict[str, Any]) -> str:
    """Two tables: methods with their means, and ratios of every method to the others after it."""
    methods = summary["methods"]
    lines = [["method", "trials", "success", *_SHOWN]]
    for name, means in methods.items():
        success = means["success"]
        rate = "–" if success is None else f"{100 * success:.1f} %"
        lines.append([name, str(means["trials"]), rate, *(_number(means[m]) for m in _SHOWN)])
    text = [_aligned(lines)]
    names = list(methods)
    pairs = [["ratio", "time", "input", "pairs", "failures"]]
    for i, above in enumerate(names):
        for below in names[i + 1 :]:
            ratio = summary["ratios"][f"{above}/{below}"]
            failed = " and ".join(str(n) for n in ratio["failures"])
            row = [_interval(ratio["time"]), _interval(ratio["input"]), str(ratio["pairs"]), failed]
            pairs.append([f"{above} / {below}", *row])
    if len(pairs) > 1:
        text.append(_aligned(pairs))
    return "\n\n".join(text)


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def _interval(values: list[float | None]) -> str:
    estimate, low, high = values
    if estimate is None:
        return "–"
    return f"{estimate:.2f}" + ("" if low is None else f" [{low:.2f}, {high:.2f}]")


def _aligned(rows: list[list[str]]) -> str:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(w) if i == 0 else cell.rjust(w)
            for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


class ProgressLine:
    """Trials done and time left on stderr: one line that changes, or a line every 10 s in a log."""

    def __init__(self) -> None:
        self._live = sys.stderr.isatty()
        self._next = 0.0

    def __call__(self, done: int, of: int, left_s: float) -> None:
        """Show the state."""
        now = time.monotonic()
        if now < self._next and done < of:
            return
        self._next = now + (0.2 if self._live else 10.0)
        left = "" if not math.isfinite(left_s) else f", {_clock(left_s)} left"
        text = f"{done} of {of} trials{left}"
        end = "" if self._live and done < of else "\n"
        print(f"\r{text:<60}" if self._live else text, end=end, file=sys.stderr, flush=True)


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d}"
