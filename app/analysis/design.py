"""From rows to cells: participants × methods × objects, and which of them are complete."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.analysis.frames import Frame, pd
from app.core.types import Array

METHOD_ORDER = ("direct", "blend", "policy", "yielding", "autonomy")
PAPER_CONTRAST = ("blend", "policy")


def order_methods(names: set[str]) -> list[str]:
    """The project's order, variants (`blend:distance-gate`) behind their method, then others."""

    def key(name: str) -> tuple[int, str]:
        base = name.split(":")[0]
        place = METHOD_ORDER.index(base) if base in METHOD_ORDER else len(METHOD_ORDER)
        return place, name

    return sorted(names, key=key)


def choose_contrast(methods: list[str], wanted: tuple[str, str] | None) -> tuple[str, str] | None:
    """Reference and method of the hypotheses: the study's, the paper's, or the first two."""
    for pair in (wanted, PAPER_CONTRAST):
        if pair is not None and set(pair) <= set(methods):
            return pair
    return (methods[0], methods[1]) if len(methods) >= 2 else None


@dataclass(frozen=True)
class Cells:
    """Means of one measure over counted trials.

    Attributes:
        measure: Column of the trials table.
        participants: Rows.
        methods: First column axis.
        objects: Second column axis.
        means: Shape (n_participants, n_methods, n_objects); NaN where a cell has no trial.
        counts: Trials per cell, same shape.
    """

    measure: str
    participants: tuple[str, ...]
    methods: tuple[str, ...]
    objects: tuple[str, ...]
    means: Array
    counts: Array

    def complete(self) -> "Cells":
        """Only the participants with a value in every cell."""
        return self._rows(np.all(np.isfinite(self.means), axis=(1, 2)))

    def of_methods(self, *methods: str) -> "Cells":
        """Only these methods, in this order; participants with none of them are left out."""
        index = [self.methods.index(m) for m in methods]
        cells = Cells(
            self.measure,
            self.participants,
            methods,
            self.objects,
            self.means[:, index],
            self.counts[:, index],
        )
        cells = cells._rows(np.any(np.isfinite(cells.means), axis=(1, 2)))
        used = np.any(np.isfinite(cells.means), axis=(0, 1))
        return Cells(
            cells.measure,
            cells.participants,
            methods,
            tuple(np.array(cells.objects)[used]),
            cells.means[:, :, used],
            cells.counts[:, :, used],
        )

    def balanced_means(self) -> tuple[tuple[str, ...], Array]:
        """Participants and their mean per method over the objects they did with every method.

        Cells that one method lacks are left out of the others too, so that a hard object missing
        in one method does not pass for a difference of methods.

        Returns:
            Participants with at least one such object, and means of shape (n, n_methods).
        """
        shared = np.isfinite(self.means).all(axis=1, keepdims=True)
        kept = np.any(shared, axis=(1, 2))
        values = np.where(shared, self.means, 0.0).sum(axis=2)[kept]
        sizes = shared.sum(axis=2)[kept]
        return tuple(np.array(self.participants)[kept]), values / sizes

    def _rows(self, kept: Any) -> "Cells":
        return Cells(
            self.measure,
            tuple(np.array(self.participants)[kept]),
            self.methods,
            self.objects,
            self.means[kept],
            self.counts[kept],
        )


def make_cells(trials: Frame, measure: str) -> Cells:
    """Average the counted trials of each participant, method and object.

    Args:
        trials: Cleaned trials of the participants who are analysed.
        measure: Name of the column to average; rows where it is empty do not count.
    """
    rows = trials[trials["counted"]].dropna(subset=[measure])
    participants = np.array(sorted(rows["participant_id"].unique()), dtype=object)
    methods = order_methods(set(rows["method"]))
    objects = sorted(rows["object"].unique())
    shape = (len(participants), len(methods), len(objects))
    where = (
        np.searchsorted(participants, rows["participant_id"].to_numpy(dtype=object)),
        pd.Categorical(rows["method"], categories=methods).codes,
        pd.Categorical(rows["object"], categories=objects).codes,
    )
    sums, counts = np.zeros(shape), np.zeros(shape)
    np.add.at(sums, where, rows[measure].to_numpy(dtype=float))
    np.add.at(counts, where, 1.0)
    means = np.divide(sums, counts, out=np.full(shape, np.nan), where=counts > 0)
    return Cells(measure, tuple(participants), tuple(methods), tuple(objects), means, counts)


def find_factors(trials: Frame) -> Frame:
    """Columns of further factors: entries of `options` and devices that differ between trials.

    Returns:
        One column per factor with at least two levels, indexed as `trials`.
    """
    parsed = {text: _parse(text) for text in trials["options"].unique()}
    names = sorted({name for options in parsed.values() for name in options})
    factors = pd.DataFrame(
        {name: [parsed[t].get(name, "preset") for t in trials["options"]] for name in names},
        index=trials.index,
    )
    if "device" in trials and (trials["device"] != "").any():
        factors["device"] = trials["device"]
    if "user_model" in trials:
        factors["user_model"] = trials["user_model"].fillna("").astype(str)
    varied = [name for name in factors if 2 <= factors[name].nunique() <= 12]
    return factors[varied]


def _parse(text: str) -> dict[str, str]:
    try:
        options = json.loads(text) if text else {}
    except ValueError:
        return {}
    if not isinstance(options, dict):
        return {}
    return {str(k): v if isinstance(v, str) else json.dumps(v) for k, v in options.items()}
