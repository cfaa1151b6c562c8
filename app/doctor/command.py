"""`hindsight doctor`: looks at everything in turn and says what to do."""

import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from app.doctor.finding import Finding, format_findings, worst
from app.doctor.graphics import check_browser
from app.doctor.machine import (
    check_capacity,
    check_clock,
    check_handles,
    check_timer,
    check_version,
)
from app.doctor.network import check_ports
from app.doctor.packages import check_kernels, check_packages, check_pages, check_python
from app.doctor.storage import check_logs, check_storage
from app.web.capacity import find_capacity

CLOSING = {
    "ok": "All is well.",
    "warn": "Sessions run; the lines marked WARN say what could be better.",
    "bad": "Sessions will not run well: see the lines marked BAD.",
}


def examine(sessions: Path, port: int, *, browser: bool = True) -> Iterator[Finding]:
    """All findings, one after another.

    Args:
        sessions: Where logs go.
        port: The page's.
        browser: Whether to start a browser, which takes a few seconds.
    """
    yield check_version()
    yield check_python()
    yield check_packages()
    yield check_kernels()
    yield from check_pages()
    if browser:
        yield check_browser()
    yield from check_ports(port)
    yield from check_storage(sessions)
    yield check_logs(sessions)
    yield check_clock()
    yield check_timer()
    yield check_capacity()
    yield check_handles(find_capacity().sessions)


def doctor(
    sessions: Path,
    port: int,
    *,
    browser: bool = True,
    as_json: bool = False,
    say: Callable[[str], None] = print,
) -> int:
    """Examine and report; returns 1 where something is bad, else 0."""
    findings: Iterable[Finding] = examine(sessions, port, browser=browser)
    if as_json:
        findings = list(findings)
        say(json.dumps([finding.to_dict() for finding in findings], indent=2))
        return int(worst(findings) == "bad")
    seen: list[Finding] = []
    for finding in findings:  # each is said as soon as it is known
        seen.append(finding)
        for line in format_findings([finding]):
            say(line)
    say(CLOSING[worst(seen)])
    return int(worst(seen) == "bad")
