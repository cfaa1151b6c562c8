"""Whatever a browser sends is obeyed or refused in words: at the edge, in a worker, in a trial."""

import json
import math
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core import UserInput, preset, settings_to_dict
from app.errors import AppError
from app.robot.scene_file import load_scene
from app.session.commands import COMMANDS, CommandError, parse_command
from app.session.inbox import Inbox
from app.session.kinematic_world import KinematicWorld
from app.session.trial import Trial
from app.web.messages import Command, InputMessage, MessageError, parse_message
from app.web.view_messages import FrameError, ViewerCamera, filter_frame
from tests.fuzz.budget import ANYTHING, LARGE, NUMBERS, SCALARS, SMALL, budget
from tests.web.test_view_messages import CAMERA

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

WORDS = ["input", "command", "event", "ping", "clients", "rtt", "end", *COMMANDS]
FIELDS = [
    *("type", "seq", "t", "left", "right", "mode", "device", "yaw", "dead_zone", "id", "name"),
    *(
        "rtt",
        "target",
        "seed",
        "method",
        "scene",
        "enabled",
        "changes",
        "preset",
        "theme",
        "client",
    ),
    *("control", "ms", "count"),
]
PAIR = st.lists(st.floats(-1, 1), min_size=2, max_size=2)
MESSAGES = st.fixed_dictionaries(
    {"type": st.sampled_from(["input", "command", "event", "ping"])},
    optional={
        "seq": st.integers(0, 2**53) | SCALARS,
        "t": st.floats(0, 1e15) | SCALARS,
        "left": PAIR | ANYTHING,
        "right": PAIR | ANYTHING,
        "mode": st.sampled_from(["translate", "rotate"]) | SCALARS,
        "id": st.integers(0, 2**53) | SCALARS,
        "name": st.sampled_from([*COMMANDS, "blur", "hidden"]) | SCALARS,
        "changes": st.dictionaries(st.text(max_size=12), SCALARS, max_size=4) | ANYTHING,
        "enabled": SCALARS,
        "method": st.sampled_from(["direct", "policy"]) | SCALARS,
        "preset": SCALARS,
        "theme": SCALARS,
        "target": SCALARS,
        "seed": SCALARS,
        "yaw": SCALARS,
        "dead_zone": SCALARS,
    },
)


@given(MESSAGES | st.dictionaries(st.sampled_from(FIELDS), ANYTHING))
@budget(LARGE)
def test_a_message_that_passes_the_edge_is_understood_by_the_worker(message: dict[str, Any]):
    """Refused at the edge, or taken by the worker, or refused there in words; never else."""
    text = json.dumps(message)
    try:
        passed = parse_message(text)
    except MessageError as error:
        assert str(error) and len(str(error)) < 1000
        return
    forwarded = {**passed.model_dump(exclude_none=True), "client": "c1"}
    inbox = Inbox(lambda: None)
    inbox.put({"type": "clients", "control": "c1", "count": 1})
    inbox.put(msgspec.json.decode(msgspec.json.encode(forwarded)))
    taken, _ = inbox.gate.current(0.0)
    assert all(map(math.isfinite, taken.axes))
    if isinstance(passed, InputMessage):
        assert inbox.gate.refused <= 1
    if isinstance(passed, Command):
        try:
            assert parse_command(forwarded).name in COMMANDS
        except CommandError as error:
            assert str(error)


@given(st.text(max_size=300) | st.binary(max_size=300).map(lambda b: b.decode("latin-1")))
@budget(LARGE)
def test_any_text_is_refused_in_words(text: str):
    """Hardly any of it is a message; none of it raises anything else."""
    try:
        parse_message(text)
    except MessageError as error:
        assert str(error)


@given(
    st.lists(st.dictionaries(st.sampled_from(FIELDS), SCALARS | st.sampled_from(WORDS)), max_size=5)
)
@budget(LARGE)
def test_the_workers_inbox_survives_any_messages(messages: list[dict[str, Any]]):
    """Also what the web process would never send; the input that counts stays finite."""
    inbox = Inbox(lambda: None)
    for message in messages:
        inbox.put(message)
    user_input, _ = inbox.gate.current(1.0)
    assert all(map(math.isfinite, user_input.axes))
    assert math.isfinite(inbox.round_trip_ms)
    assert len(inbox.take()) <= len(messages)


SETTING_NAMES = sorted(settings_to_dict(preset("default")))


@given(
    st.lists(
        st.fixed_dictionaries(
            {
                "type": st.just("command"),
                "id": st.just(1),
                "name": st.sampled_from(sorted(COMMANDS)),
            },
            optional={
                "changes": st.dictionaries(
                    st.sampled_from(SETTING_NAMES),
                    NUMBERS | st.floats(0, 2) | st.booleans() | st.text(max_size=5),
                    min_size=1,
                    max_size=4,
                ),
                "enabled": st.booleans(),
                "method": st.sampled_from(
                    ["direct", "blend", "policy", "yielding", "autonomy", "?"]
                ),
            },
        ),
        max_size=6,
    )
)
@budget(SMALL)
def test_a_trial_survives_any_commands(commands: list[dict[str, Any]]):
    """Settings at their very ends, and beyond: refused in words, or the next ticks are finite."""
    trial = Trial(KinematicWorld(_SCENE, 1), preset("default"), "glass", start_delay_s=0.0)
    for message in commands:
        try:
            trial.command(parse_command(message))
        except AppError as error:
            assert str(error)
        for axes in ((0.0, 0.3, -1.0, 1.0), (0.0, 0.0, 0.0, 0.0)):
            record = trial.step(UserInput(axes=axes))
            for numbers in (record.executed_twist, record.belief, record.joint_positions_rad):
                assert np.isfinite(numbers).all(), (message, record)
            assert sum(record.belief) == pytest.approx(1.0, abs=1e-6)


_SCENE = load_scene("default")


@given(st.data())
@budget(LARGE)
def test_a_mutated_camera_passes_clean_or_not_at_all(data: st.DataObject):
    """Bytes of a good frame overwritten, dropped, doubled: what passes is a camera once more."""
    frame = bytearray(msgspec.msgpack.encode(CAMERA))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(frame)))
        cut = data.draw(st.integers(0, 3))
        frame[at : at + cut] = data.draw(st.binary(max_size=4))
    _filter(bytes(frame))


@given(st.dictionaries(st.sampled_from([*CAMERA, "x"]), ANYTHING | st.just("ViewerCameraMessage")))
@budget(LARGE)
def test_a_camera_of_anything_passes_clean_or_not_at_all(fields: dict[str, Any]):
    """Well-formed msgpack of the wrong kind; integers beyond 64 bits cannot even be written."""
    try:
        frame = msgspec.msgpack.encode({**CAMERA, **fields})
    except OverflowError:
        return
    _filter(frame)


def _filter(frame: bytes) -> None:
    try:
        passed = filter_frame(frame)
    except FrameError as error:
        assert str(error)
        return
    camera = msgspec.msgpack.decode(passed, type=ViewerCamera)
    numbers = [*camera.wxyz, *camera.position, *camera.look_at, *camera.up_direction]
    assert all(map(math.isfinite, [*numbers, camera.fov, camera.near, camera.far]))
