"""Counterbalancing: every order as often, every object order as often, slots that come back."""

from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from app.study.index import Index
from app.study.orders import full, object_order, pick_cell, williams


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6])
def test_williams_balances_first_order_carry_over(n: int):
    """Each condition at each place equally often, and after each other equally often."""
    rows = williams(n)
    assert len(rows) == (n if n % 2 == 0 else 2 * n)
    places = Counter((i, c) for row in rows for i, c in enumerate(row))
    pairs = Counter(pair for row in rows for pair in zip(row, row[1:], strict=False))
    assert len(places) == n * n and len(set(places.values())) == 1
    assert len(pairs) == n * (n - 1) and len(set(pairs.values())) == 1


def test_full_has_every_order_once():
    """Six orders of three."""
    assert len(set(full(3))) == 6


def test_object_orders_are_blocked():
    """Six participants of a cell in a row meet the six orders of three objects."""
    names = ("a", "b", "c")
    for block in range(3):
        slots = range(6 * block, 6 * block + 6)
        assert len({tuple(object_order(names, 1, 0, slot, 0)) for slot in slots}) == 6
    assert object_order(names, 1, 0, 2, 0) == object_order(names, 1, 0, 2, 0)


def test_the_next_cell_is_the_one_with_the_fewest_completed():
    """Active participants fill a cell for the moment; completed ones for good."""
    assert pick_cell([0, 0], [0, 0]) == 0
    assert pick_cell([0, 0], [1, 0]) == 1
    assert pick_cell([2, 1], [0, 1]) == 1
    assert pick_cell([3, 2, 2], [0, 0, 1]) == 1


def claim(index: Index, name: str, **options: object):
    """One participant more."""
    entry, new = index.claim(2, "p", request=name, person="", token=name, **options)  # type: ignore[arg-type]
    assert new
    return entry


def test_abandoned_slots_come_back_and_pilots_do_not_count(tmp_path: Path):
    """A slot is free again when its holder is silent for long, has left, or is excluded."""
    index = Index(tmp_path, "paper")
    first, second = claim(index, "a"), claim(index, "b")
    assert (first.cell, second.cell) == (0, 1)
    pilot = claim(index, "c", pilot=True)
    assert pilot.cell == 0
    index.put(replace(first, seen_s=0.0))
    again = claim(index, "d")
    assert (again.cell, again.slot) == (first.cell, first.slot)
    index.put(replace(second, status="completed"))
    index.put(replace(again, status="excluded"))
    last = claim(index, "e")
    assert (last.cell, last.slot) == (0, 0)
    index.close()


def test_claims_from_many_threads_and_connections_are_unique(tmp_path: Path):
    """No slot and no pseudonym twice, cells even; the same request keeps its slot."""

    def some(worker: int) -> list[tuple[str, int, int]]:
        index = Index(tmp_path, "paper", busy_ms=60_000)
        entries = [claim(index, f"{worker}/{i}") for i in range(8)]
        index.close()
        return [(e.id, e.cell, e.slot) for e in entries]

    with ThreadPoolExecutor(6) as pool:
        taken = [entry for part in pool.map(some, range(6)) for entry in part]
    assert len({t[0] for t in taken}) == 48
    assert len({t[1:] for t in taken}) == 48
    assert Counter(t[1] for t in taken) == {0: 24, 1: 24}
    index = Index(tmp_path, "paper")
    entry, new = index.claim(2, "p", request="3/5", person="", token="other")
    assert not new and entry.id in {t[0] for t in taken}
    index.close()
