"""How numbers are written in the report."""

import numpy as np

DASH = "–"


def number(value: float, digits: int = 2) -> str:
    """A number with fixed digits, a real minus sign, and a dash where there is none."""
    if value is None or not np.isfinite(value):
        return DASH
    text = f"{value:.{digits}f}"
    if text.strip("-0.") == "":
        text = text.lstrip("-")
    return text.replace("-", "−")


def p_value(p: float) -> str:
    """A p-value for a table: .006, < .001 or a dash."""
    if p is None or not np.isfinite(p):
        return DASH
    return "< .001" if p < 0.001 else ("1.000" if p >= 0.9995 else f"{p:.3f}"[1:])


def interval(low: float, high: float, digits: int = 2) -> str:
    """[low, high], or a dash."""
    if not (np.isfinite(low) and np.isfinite(high)):
        return DASH
    return f"[{number(low, digits)}, {number(high, digits)}]"


def mean_and_sd(mean: float, sd: float) -> str:
    """A mean ± SD, both with the digits that the SD leaves a meaning to."""
    size = sd if np.isfinite(sd) and sd > 0 else abs(mean)
    digits = next((d for d, low in ((1, 1.0), (2, 0.1), (3, 0.001)) if size >= low), 4)
    return f"{number(mean, digits)} ± {number(sd, digits)}"
