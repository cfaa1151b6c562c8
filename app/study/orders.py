"""Orders of conditions and objects, and who is next in which: counterbalancing."""

import itertools
import math
import random
from collections.abc import Sequence

Row = tuple[int, ...]


def williams(n: int) -> list[Row]:
    """Williams' design: every condition follows every other equally often.

    n rows for even n, 2 n for odd n (Williams 1949): the first row is 0, 1, n−1, 2, n−2, …, the
    others add 1 modulo n; for odd n their mirror images follow.
    """
    first = [0]
    for i in range(1, n):
        first.append((i + 1) // 2 if i % 2 else n - i // 2)
    rows = [tuple((x + shift) % n for x in first) for shift in range(n)]
    return rows if n % 2 == 0 or n == 1 else rows + [row[::-1] for row in rows]


def full(n: int) -> list[Row]:
    """Every order of n conditions, n! rows."""
    return list(itertools.permutations(range(n)))


ORDERS = {"full": full, "williams": williams}


def object_order(names: Sequence[str], seed: int, cell: int, slot: int, block: int) -> list[str]:
    """The objects in random order for one participant, blocked.

    Within a cell, as many participants in a row as there are orders (at most 24: four objects) meet
    every order once. With more objects each order is drawn by itself.

    Args:
        names: The objects.
        seed: Of the study.
        cell: The participant's order cell.
        slot: The participant's place within the cell.
        block: Which of the participant's blocks of trials.
    """
    count = math.factorial(len(names))
    if count > 24:
        rng = random.Random(f"{seed}/{cell}/{slot}/{block}")
        return rng.sample(list(names), len(names))
    rng = random.Random(f"{seed}/{cell}/{slot // count}/{block}")
    orders = list(itertools.permutations(names))
    rng.shuffle(orders)
    return list(orders[slot % count])


def pick_cell(completed: Sequence[int], active: Sequence[int]) -> int:
    """The cell of the next participant.

    The fewest completed and active ones together, among those the fewest completed; the first one
    of what is left.

    Args:
        completed: Completed participants per cell; pilots do not count.
        active: Participants per cell who take part now; the abandoned do not count.
    """
    filled = [(c + a, c, i) for i, (c, a) in enumerate(zip(completed, active, strict=True))]
    return min(filled)[2]
