# pyright: reportAttributeAccessIssue=false
"""What the 3-D view costs the server: a tick drawn, a picture of the value slice."""

import contextlib
import io
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from app.core import make_goals, preset, value_slice
from app.core.types import Goals
from app.recording.schema import StepRecord
from app.robot.model import build_model
from app.robot.scene import Scene
from app.robot.scene_file import load_scene
from app.session.drawing import Viewer, subject_of
from app.session.drawing.palette import DARK
from app.session.drawing.slice_picture import slice_picture

RATE_HZ = 60.0
SECONDS = 5.0
PICTURES = 30
SIDE_M = 0.9


class CountingClient:
    """A browser's stand-in: takes all that the view sends and counts the bytes."""

    def __init__(self, port: int):
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        self._socket = connect(
            f"ws://127.0.0.1:{port}", subprotocols=[protocol], compression=None, max_size=None
        )
        self.received, self.frames = 0, 0
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            for message in self._socket:
                self.received += len(message)
                self.frames += 1

    def close(self) -> None:
        """Disconnect."""
        self._socket.close()
        self._thread.join(timeout=2.0)


def bench_scene() -> dict[str, dict[str, Any]]:
    """Names → {median, p99, unit}: scene_update, slice_64, slice_128.

    `scene_update` is one `Viewer.update` at 60 Hz with one client connected, while all joints, both
    arrows and the belief change in every tick, more than a trial asks for. Beside it stand what the
    client receives [kB/s], in how many windows a second, and the share of
    a core the whole process spends. `slice_n` is an n × n picture: values, colours, PNG.
    """
    with _server() as server:
        return {"scene_update": _scene_update(server)} | {
            f"slice_{n}": _slice(server, n) for n in (64, 128)
        }


@contextlib.contextmanager
def _server() -> Iterator[viser.ViserServer]:
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints a banner whatever `verbose` says
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        yield server
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def _scene_update(server: viser.ViserServer) -> dict[str, Any]:
    scene = load_scene("default")
    records, goals = moving_records(scene, round(RATE_HZ * SECONDS)), _goals(scene)
    viewer = Viewer(server, scene)
    viewer.set_layers({"slice": False})
    client = CountingClient(server.get_port())
    try:
        for record in records[:30]:
            viewer.update(record, goals)
            time.sleep(1.0 / RATE_HZ)
        client.received = client.frames = 0
        durations = []
        cpu, start = time.process_time(), time.perf_counter()
        for index, record in enumerate(records):
            before = time.perf_counter()
            viewer.update(record, goals)
            durations.append(time.perf_counter() - before)
            time.sleep(max(0.0, start + (index + 1) / RATE_HZ - time.perf_counter()))
        elapsed = time.perf_counter() - start
        return _figure(durations) | {
            "kB/s": round(client.received / elapsed / 1e3, 1),
            "updates/s": round(client.frames / elapsed, 1),
            "core": round((time.process_time() - cpu) / elapsed, 3),
        }
    finally:
        client.close()
        viewer.close()


def _slice(server: viser.ViserServer, side: int) -> dict[str, Any]:
    scene = load_scene("default")
    goals, settings, cell = _goals(scene), preset("default"), SIDE_M / side
    blank = np.zeros((side, side, 4), dtype=np.uint8)
    image = server.scene.add_image("/bench", blank, SIDE_M, SIDE_M, format="png")

    def draw(index: int) -> None:
        share = index / PICTURES
        values = value_slice(
            settings,
            goals,
            np.array([0.2 + 0.4 * share, 0.6 - 0.4 * share, 0.2]),
            [0.0, -0.45, 0.0],
            [0.0, SIDE_M, 0.0],
            [SIDE_M, 0.0, 0.0],
            (side, side),
            [0.0, 1.0, 0.0, 0.0],
        )
        image.image = slice_picture(values, DARK, cell)[0]

    figure = _figure([_timed(draw, i) for i in range(-3, PICTURES)][3:])
    image.remove()
    return figure


def _timed(action: Callable[[int], None], index: int) -> float:
    start = time.perf_counter()
    action(index)
    return time.perf_counter() - start


def _figure(seconds: list[float]) -> dict[str, Any]:
    milliseconds = 1e3 * np.asarray(seconds)
    return {
        "median": round(float(np.median(milliseconds)), 3),
        "p99": round(float(np.percentile(milliseconds, 99)), 3),
        "unit": "ms",
    }


def _goals(scene: Scene) -> Goals:
    """Sixteen targets round each object, the hand level."""
    rng = np.random.default_rng(0)
    level = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])
    goals = {}
    for item, place in zip(scene.objects, scene.places, strict=False):
        centre = np.array([place.x_m, place.y_m, 0.06])
        goals[item.name] = (centre + rng.normal(0.0, 0.02, (16, 3)), np.tile(level, (16, 1)))
    return make_goals(goals)


def moving_records(scene: Scene, count: int) -> list[StepRecord]:
    """Ticks of an arm all of whose joints swing slowly while the belief changes."""
    model = build_model(scene)
    subject, data = subject_of(model, scene.object_names), mujoco.MjData(model)
    start, poses = scene.start_joint_positions, []
    for place in scene.places[: len(scene.objects)]:
        poses += [place.x_m, place.y_m, 0.0, 1.0, 0.0, 0.0, 0.0]
    n_goals, records = len(scene.objects), []
    for index in range(count):
        phase = index / RATE_HZ
        joints = start + 0.2 * np.sin(phase * np.arange(1.0, 1.0 + len(start)))
        data.qpos[subject.joint_addresses] = joints
        mujoco.mj_kinematics(model, data)
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, data.site_xmat[subject.hand_site])
        weights = np.exp(np.sin(phase + np.arange(n_goals)))
        twist = (0.1 * np.sin(phase + np.arange(6.0))).tolist()
        records.append(
            StepRecord(
                step=index,
                time_s=phase,
                monotonic_s=phase,
                wall_s=phase,
                phase="running",
                outcome="running",
                sequence=index,
                client_time_ms=1e3 * phase,
                device="none",
                axes=[0.0] * 4,
                buttons=0,
                mode="translate",
                dead_zone=0.1,
                view_yaw_rad=0.0,
                input_norm=0.0,
                input_s=0.0,
                method="policy",
                enabled=True,
                settings_id=0,
                direct_twist=twist,
                assistance_twist=twist[::-1],
                known_goal_assistance_twist=[0.0] * 6,
                executed_twist=twist,
                belief=(weights / weights.sum()).tolist(),
                values=[0.0] * n_goals,
                q_values=[0.0] * n_goals,
                best_targets=[16 * g for g in range(n_goals)],
                hand_position_m=data.site_xpos[subject.hand_site].tolist(),
                hand_quaternion=quaternion.tolist(),
                joint_positions_rad=joints.tolist(),
                joint_velocities_rad_s=[0.0] * len(start),
                finger_positions_m=[0.0, 0.0],
                ctrl=[0.0] * 8,
                object_poses=poses,
                lateness_s=0.0,
                round_trip_ms=0.0,
            )
        )
    return records
