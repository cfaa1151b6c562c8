"""Which object comes next: every object once in random order, then again in another."""

import random
from collections.abc import Sequence


class TargetOrder:
    """Goes through shuffled blocks of all names, never the same twice in a row."""

    def __init__(self, names: Sequence[str], seed: int) -> None:
        """Begin with the first block.

        Args:
            names: The objects.
            seed: Equal seeds give equal orders.
        """
        self._names = tuple(names)
        self._random = random.Random(seed)
        self._block: list[str] = []
        self._last = ""

    def next(self) -> str:
        """The next name."""
        if not self._block:
            self._block = list(self._names)
            self._random.shuffle(self._block)
            if self._block[0] == self._last and len(self._block) > 1:
                self._block.append(self._block.pop(0))
        self._last = self._block.pop(0)
        return self._last

    def note(self, name: str) -> None:
        """An object was chosen by hand: it does not come again in this block."""
        self._last = name
        if name in self._block:
            self._block.remove(name)
