"""Exact soft values on a grid: one sparse linear solve instead of value iteration.

With cost c per step and V^≈(x) = −log Σ_paths exp(−cost), z = exp(−V^≈) obeys z(x) = e^(−c)
Σ_neighbours z(x'), z(target) = 1: linear, solved once per target. It needs c > log(number of
actions) to converge.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

from app.core.types import Array

STEPS = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])


@dataclass(frozen=True)
class Grid:
    """A 4-connected grid with a constant cost per step [nat]."""

    shape: tuple[int, int]
    cost: float

    def soft_value(self, target: tuple[int, int]) -> Array:
        """Return V^≈ of one target at every cell [nat], shape `shape`."""
        rows, columns = self.shape
        cells = np.arange(rows * columns)
        x, y = np.divmod(cells, columns)
        goal = target[0] * columns + target[1]
        a, b = [], []
        for dx, dy in STEPS:
            inside = (0 <= x + dx) & (x + dx < rows) & (0 <= y + dy) & (y + dy < columns)
            inside &= cells != goal
            a.append(cells[inside])
            b.append((x + dx)[inside] * columns + (y + dy)[inside])
        i, j = np.concatenate(a), np.concatenate(b)
        moves = sparse.csc_matrix((np.full(len(i), np.exp(-self.cost)), (i, j)), (len(cells),) * 2)
        right = np.zeros(len(cells))
        right[goal] = 1.0
        z = spsolve(sparse.identity(len(cells), format="csc") - moves, right)
        return -np.log(np.asarray(z)).reshape(self.shape)

    def iterated_soft_value(self, target: tuple[int, int], passes: int) -> Array:
        """Return the same by soft value iteration, the definition; slow, to check the solve."""
        value = np.full(self.shape, np.inf)
        value[target] = 0.0
        for _ in range(passes):
            padded = np.pad(value, 1, constant_values=np.inf)
            around = [padded[2:, 1:-1], padded[:-2, 1:-1], padded[1:-1, 2:], padded[1:-1, :-2]]
            with np.errstate(divide="ignore"):
                value = self.cost - np.log(sum(np.exp(-v) for v in around))
            value[target] = 0.0
        return value

    def walk(
        self, soft: Array, start: tuple[int, int], rng: np.random.Generator | None
    ) -> list[tuple[int, int]]:
        """Return the cells from `start` to a target of `soft`: sampled from π, or greedy."""
        path, cell = [start], start
        while soft[cell] > 1e-9 and len(path) < 1000:
            options = [(cell[0] + int(dx), cell[1] + int(dy)) for dx, dy in STEPS]
            options = [
                o for o in options if 0 <= o[0] < self.shape[0] and 0 <= o[1] < self.shape[1]
            ]
            logits = -np.array([soft[o] for o in options])
            if rng is None:
                cell = options[int(np.argmax(logits))]
            else:
                p = np.exp(logits - logits.max())
                cell = options[int(rng.choice(len(options), p=p / p.sum()))]
            path.append(cell)
        return path
