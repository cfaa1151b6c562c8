"""Which object stands at which place."""

import numpy as np

from app.robot.scene import Layout, Scene


def random_layout(scene: Scene, rng: np.random.Generator) -> Layout:
    """Draw a random order of the objects over the places, every order equally probable."""
    chosen = rng.permutation(len(scene.places))[: len(scene.objects)]
    return tuple(int(place) for place in chosen)
