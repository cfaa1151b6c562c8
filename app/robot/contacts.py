# pyright: reportAttributeAccessIssue=false
"""How hard each pad presses each object."""

import mujoco
import numpy as np

from app.core.types import Array
from app.robot.simulation import Simulation

PADS = ("pad_left", "pad_right")


def pad_forces(sim: Simulation) -> Array:
    """Normal force of each pad on each object [N], of the last physics step, shape (2, n_objects).

    Read from MuJoCo's contact list, only while the hand closes: contact sensors would cost 6 µs in
    each of the five physics steps of every tick.
    """
    model, data = sim.model, sim.data
    forces = np.zeros((len(PADS), len(sim.scene.objects)))
    if data.ncon == 0:
        return forces
    owner = sim.geom_object
    pads = {model.geom(name).id: row for row, name in enumerate(PADS)}
    wrench = np.empty(6)
    for number, (first, second) in enumerate(data.contact.geom.tolist()):
        if first in pads:
            pad, item = pads[first], owner[second]
        elif second in pads:
            pad, item = pads[second], owner[first]
        else:
            continue
        if item >= 0:
            mujoco.mj_contactForce(model, data, number, wrench)
            forces[pad, item] += wrench[0]
    return forces


def gripped_object(sim: Simulation, least_force: float) -> int | None:
    """The object both pads press with more than the given force [N], or None."""
    pressed = np.flatnonzero((pad_forces(sim) > least_force).all(axis=0))
    return int(pressed[0]) if len(pressed) else None
