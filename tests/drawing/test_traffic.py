"""What a viewer is sent while the arm moves: at most 30 kB a second, the value slice included."""

import math
import time
from collections.abc import Callable

import msgspec
import numpy as np
import viser

from app.bench.scene import CountingClient, moving_records
from app.core import UserInput, preset
from app.core.settings import AssistanceSettings
from app.core.types import Goals
from app.recording.schema import StepRecord
from app.robot.scene import Scene
from app.session.drawing import Viewer
from app.session.drawing.slice_layer import DRAFT_PERIOD_S, SliceLayer
from app.session.physics_world import PhysicsWorld
from app.session.trial import Trial

RATE_HZ = 60.0
UPDATES = 180
LIMIT = 30_000  # [byte/s]
SLICE = 3_200  # [byte/s] of them for the slice


def test_a_moving_arm_stays_within_its_share(
    viewer: Viewer, server: viser.ViserServer, scene: Scene
) -> None:
    """A trial under policy whose sticks are pushed in circles: everything on the way moves.

    Counted per update, so that a slow machine changes nothing: 60 of them are a second.
    """
    trial = Trial(PhysicsWorld(scene, 1), preset("default"), "glass", start_delay_s=0.0)
    ticks = [trial.step(circling(round(k * 100 / RATE_HZ))) for k in range(UPDATES)]
    viewer.set_layers({"slice": False})
    client = CountingClient(server.get_port())
    try:
        for belief in ([0.5, 0.5, 0.0], [0.0, 0.5, 0.5]):  # a ghost's mesh is sent once
            likely = msgspec.structs.replace(ticks[0], belief=belief)
            viewer.update(likely, trial.goals, trial.settings)
        viewer.update(ticks[0], trial.goals, trial.settings)
        quiet = -1
        while quiet != client.received or not client.received:
            quiet = client.received
            time.sleep(0.3)
        client.received = client.frames = 0
        for tick in ticks:
            viewer.update(tick, trial.goals, trial.settings)
            time.sleep(1.0 / RATE_HZ)
        time.sleep(0.3)
        assert client.frames > 0
        assert client.received / UPDATES * RATE_HZ <= LIMIT - SLICE
    finally:
        client.close()


def circling(tick: int) -> UserInput:
    """Sticks that go round in 4 s, a new reading in every tick."""
    angle = 2.0 * math.pi * 0.01 * tick / 4.0
    axes = (0.0, 0.15 * math.sin(angle / 2), 0.6 * math.cos(angle), 0.6 * math.sin(angle))
    return UserInput(axes=axes, sequence=tick)


def test_arrows_move_in_every_third_update(
    viewer: Viewer, server: viser.ViserServer, records: list[StepRecord]
) -> None:
    """A lone update is drawn in full; of a fast series each arrow takes every third one."""

    def told(step: int, x: float) -> float:
        twist = [x, 0.1, 0.0, 0.0, 0.0, 0.0]
        tick = msgspec.structs.replace(records[0], step=step, direct_twist=twist)
        viewer.update(tick)
        arrow = server.scene.get_handle_by_name("/hindsight/arrow/user")
        assert isinstance(arrow, viser.ArrowsHandle)
        return float(np.asarray(arrow.points)[0, 1, 0])

    tips = [told(step, 0.02 * step) for step in range(1, 8)]
    assert len(set(tips)) == 3
    before = tips[-1]
    assert told(8, 0.2) == told(9, 0.2) == before < told(10, 0.2)


def test_a_slice_that_keeps_changing_is_sent_in_drafts(
    server: viser.ViserServer,
    scene: Scene,
    goals: Goals,
    settings: AssistanceSettings,
    viewer: Viewer,
) -> None:
    """Small ones while the belief moves, a fine one where a person begins to look or it rests."""
    layer: SliceLayer = viewer._slice
    tick = msgspec.structs.replace(moving_records(scene, 1)[0], best_targets=[0, 2, 4])
    belief = [0.2, 0.2, 0.6]

    def update(step: int, leading: float) -> None:
        belief[:] = [1.0 - leading - 0.1, 0.1, leading]
        changed = msgspec.structs.replace(tick, step=step, belief=list(belief))
        viewer.update(changed, goals, settings)

    def size() -> int:
        image = server.scene.get_handle_by_name("/hindsight/slice")
        return len(image._data) if isinstance(image, viser.ImageHandle) else 0

    update(0, 0.3)
    _until(lambda: layer.pictures == 1)
    fine = size()
    for step in range(1, 400):
        update(step, 0.3 + 0.001 * step)
        time.sleep(0.005)
        if layer.pictures >= 3:
            break
    draft = size()
    assert draft < fine / 4
    assert draft / DRAFT_PERIOD_S <= SLICE
    _until(lambda: size() > 2 * draft)  # at rest


def _until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)
