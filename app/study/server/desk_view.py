"""What the experimenter's desk shows, as JSON."""

import time
from collections import Counter
from typing import Any

from app.study.plan import cells
from app.study.server.host import Host
from app.study.store import Person


def desk_state(host: Host) -> dict[str, Any]:
    """Everybody, and how the cells are filled."""
    store = host.store
    people = sorted(store.people.values(), key=lambda person: person.id)
    real = [p for p in people if not p.consent.pilot]
    n = len(cells(store.study))
    done = Counter(p.consent.cell for p in real if p.state.status == "completed")
    live = Counter(p.consent.cell for p in real if p.state.status == "running")
    pool = host.registry.workers if host.registry is not None else None
    return {
        "study": store.study.title,
        "name": store.study.name,
        "test": store.test,
        "paused": host.paused,
        "wanted": store.study.participants,
        "pilot": f"/?pilot={host.pilot_key}",
        "places": [pool.count, pool.capacity] if pool is not None else [0, 0],
        "cells": [{"cell": c + 1, "completed": done[c], "running": live[c]} for c in range(n)],
        "people": [_person(host, person) for person in people],
    }


def _person(host: Host, person: Person) -> dict[str, Any]:
    state, session = person.state, host.sessions.get(person.id)
    last = next(reversed(host.store.index.rows(person.id).values()), {})
    trial = session.trial if session is not None and session.worker is not None else None
    trials = [
        {
            "index": a.started.index,
            "part": a.started.part,
            "label": a.started.label,
            "target": a.started.target,
            "attempt": a.started.attempt,
            "outcome": "discarded" if a.discarded else a.outcome or "running",
        }
        for a in state.attempts
        if a.started.part != "free"
    ]
    return {
        "id": person.id,
        "cell": person.consent.cell + 1,
        "pilot": person.consent.pilot,
        "status": state.status,
        "why": state.why,
        "step": state.step.kind,
        "page": state.step.page,
        "at": [state.at, len(state.plan.steps) - 1],
        "here": session is not None and session.has_owner,
        "silent_s": round(time.time() - person.entry.seen_s),
        "phase": trial.phase if trial is not None else "",
        "round_trip_ms": last.get("round_trip_ms"),
        "late_share": last.get("late_share"),
        "notes": state.notes,
        "trials": trials,
    }
