"""One line of the doctor's report."""

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any, Literal

Level = Literal["ok", "warn", "bad"]
"""ok: as it should be. warn: sessions run, something will be missed. bad: sessions will not run, or
will lose data."""


@dataclass(frozen=True)
class Finding:
    """What was looked at, how it is, and what to do.

    Attributes:
        name: What was looked at.
        level: How it is.
        text: The same in words, with figures.
        advice: What to do; empty where nothing is to be done.
    """

    name: str
    level: Level
    text: str
    advice: str = ""

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        return asdict(self)


def format_findings(findings: Iterable[Finding]) -> Iterator[str]:
    """A line each, with what to do below it."""
    for finding in findings:
        yield f"{finding.level.upper():<4}  {finding.name}: {finding.text}"
        if finding.advice:
            yield f"      → {finding.advice}"


def worst(findings: Iterable[Finding]) -> Level:
    """The worst level among them."""
    levels = {finding.level for finding in findings}
    return "bad" if "bad" in levels else "warn" if "warn" in levels else "ok"
