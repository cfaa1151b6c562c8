"""Probabilities as viser's own labels, for pages that cannot draw tags of their own."""

from collections.abc import Sequence

import viser


class LabelNodes:
    """Labels `/tag/<name>/label` that say each goal's name and probability."""

    def __init__(self, server: viser.ViserServer, names: tuple[str, ...]):
        self._names = names
        self._labels = [
            server.scene.add_label(f"/tag/{name}/label", name, visible=False) for name in names
        ]

    def update(self, belief: Sequence[float] | None) -> None:
        """Show a belief (n_goals,) with two digits, or hide all labels for None."""
        for index, label in enumerate(self._labels):
            label.visible = belief is not None
            if belief is not None:
                label.text = f"{self._names[index]} {belief[index]:.2f}"
