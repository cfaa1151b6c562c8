"""Whose input counts: laws of the gate, on a clock of the test's own."""

import math
from typing import Any

import pytest

from app.session.watchdog import INPUT_TIMEOUT_S, InputError, InputGate, parse_input


def message(seq: int, t_ms: float, client: str = "c1", **changes: Any) -> dict[str, Any]:
    """An input message with the right stick pushed away."""
    pushed = {"left": [0, 0], "right": [0.1, 0.9], "mode": "translate", "device": "pointer"}
    return {
        "seq": seq,
        "t": t_ms,
        "client": client,
        "yaw": 0.5,
        "dead_zone": 0.1,
        **pushed,
    } | changes


@pytest.fixture
def gate() -> InputGate:
    """A gate with c1 in control that has just accepted an input, at 10 s."""
    gate = InputGate()
    gate.set_control("c1")
    assert gate.accept(message(1, 0.0), 10.0) is True
    return gate


def axes(gate: InputGate, now_s: float) -> tuple[float, ...]:
    """The axes that count."""
    return gate.current(now_s)[0].axes


ZERO = (0.0, 0.0, 0.0, 0.0)
PUSHED = (0.0, 0.0, 0.1, 0.9)


def test_input_counts_for_its_time(gate: InputGate):
    """Until 0.3 s after it came, then zero user input with the reason."""
    assert gate.current(10.0 + INPUT_TIMEOUT_S - 1e-6) == (gate.current(10.0)[0], "")
    assert axes(gate, 10.29) == PUSHED
    user_input, loss = gate.current(10.31)
    assert (user_input.axes, loss) == (ZERO, "silent")
    assert user_input.sequence == 1  # what was lost is still told


def test_newest_wins(gate: InputGate):
    """Of several messages between two ticks the last one counts."""
    gate.accept(message(2, 16.0, right=[0.5, 0.0]), 10.016)
    assert gate.accept(message(3, 32.0, right=[-0.5, 0.0]), 10.032) is True
    assert axes(gate, 10.04) == (0.0, 0.0, -0.5, 0.0)
    assert gate.accept(message(4, 48.0, right=[-0.5, 0.0]), 10.048) is False  # nothing changed


@pytest.mark.parametrize(
    ("away", "back", "loss"), [("blur", "focus", "blur"), ("hidden", "visible", "hidden")]
)
def test_a_page_that_is_away_gives_no_input(gate: InputGate, away: str, back: str, loss: str):
    """Whatever it sends meanwhile; after it is back only a new message counts."""
    gate.page_event("c1", away)
    gate.accept(message(2, 16.0), 10.016)
    assert gate.current(10.02)[0].axes == ZERO
    assert gate.current(10.02)[1] == loss
    gate.page_event("c1", back)
    assert gate.current(10.03)[1] == "silent"
    gate.accept(message(3, 40.0), 10.04)
    assert axes(gate, 10.05) == PUSHED


def test_events_of_spectators_have_no_effect(gate: InputGate):
    """Only the page in control can blur."""
    gate.page_event("c2", "hidden")
    assert axes(gate, 10.1) == PUSHED


def test_control_decides(gate: InputGate):
    """Others are refused; who loses control loses the input at once."""
    with pytest.raises(InputError, match="'c1' has control"):
        gate.accept(message(7, 100.0, client="c2"), 10.1)
    gate.set_control(None)
    assert gate.current(10.1)[1] == "nobody"
    gate.set_control("c2")
    assert axes(gate, 10.1) == ZERO
    gate.accept(message(1, 5.0, client="c2"), 10.2)  # another page counts from its own beginning
    assert axes(gate, 10.2) == PUSHED


def test_a_dropped_socket_is_zero_input(gate: InputGate):
    """At once, not after the timeout."""
    gate.disconnect()
    assert (axes(gate, 10.01), gate.current(10.01)[1]) == (ZERO, "disconnected")


def test_replayed_and_overtaken_messages_are_refused(gate: InputGate):
    """By sequence number and by the page's time, each alone."""
    gate.accept(message(5, 80.0), 10.08)
    for seq, t in ((5, 90.0), (4, 90.0), (6, 70.0)):
        with pytest.raises(InputError, match="is not after"):
            gate.accept(message(seq, t, right=[1.0, 1.0]), 10.09)
    assert axes(gate, 10.09) == PUSHED
    assert gate.refused == 3


def test_a_queue_of_stale_messages_never_moves_the_arm(gate: InputGate):
    """After a stall of 2 s all that waited is refused, but for the last 0.3 s of it."""
    for i in range(60):
        gate.accept(message(2 + i, 16.0 * (i + 1)), 10.0 + 0.016 * (i + 1))
    arrived, accepted = 13.0, []
    for i in range(120):
        t_ms = 1000.0 + 16.7 * i
        try:
            gate.accept(message(100 + i, t_ms, right=[-1.0, 0.0]), arrived)
            accepted.append(t_ms)
        except InputError:
            assert axes(gate, arrived) == ZERO
    assert accepted and min(accepted) >= 3000.0 - 300.0 - 1e-6


def test_a_page_that_slept_is_heard_again(gate: InputGate):
    """A clock that stood still, or was set back, is learnt within a second of messages."""
    for jump_s in (3600.0, -3600.0):
        gate.set_control(f"p{jump_s}")
        start = 100.0
        gate.accept(message(1, 4e6, client=f"p{jump_s}"), start)
        heard_at = math.inf
        for i in range(1, 120):
            now = start + jump_s * (jump_s > 0) + 0.016 * i
            t_ms = 4e6 + 16.0 * i + min(0.0, jump_s) * 1000
            try:
                gate.accept(message(1 + i, t_ms, client=f"p{jump_s}"), now)
                heard_at = min(heard_at, 0.016 * i)
            except InputError:
                pass
        assert heard_at < 1.0


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"left": [0.0, float("nan")]}, "left is nan"),
        ({"right": [0.0, 1.5]}, "right is 1.5"),
        ({"right": [0.0]}, r"valid: \[x, y\]"),
        ({"right": "up"}, r"valid: \[x, y\]"),
        ({"mode": "fly"}, "valid: translate, rotate"),
        ({"seq": -1}, "seq is -1"),
        ({"seq": 1.5}, "seq is 1.5"),
        ({"seq": True}, "seq is True"),
        ({"t": float("inf")}, "t is inf"),
        ({"t": None}, "t is None"),
        ({"yaw": "north"}, "yaw is 'north'"),
        ({"dead_zone": 1.0}, "dead_zone is 1.0"),
        ({"device": 7}, "device is 7"),
    ],
)
def test_malformed_input_is_refused(gate: InputGate, changes: dict[str, Any], text: str):
    """The error names field and value; what counted before goes on counting."""
    with pytest.raises(InputError, match=text):
        gate.accept({**message(2, 16.0), **changes}, 10.016)
    assert axes(gate, 10.02) == PUSHED


def test_a_message_becomes_an_input():
    """Every field arrives where D(u) reads it."""
    user_input = parse_input(message(7, 123.0, left=[-0.2, 0.3], mode="rotate"))
    assert user_input.axes == (-0.2, 0.3, 0.1, 0.9)
    assert (user_input.mode, user_input.view_yaw, user_input.dead_zone) == ("rotate", 0.5, 0.1)
    assert (user_input.device, user_input.sequence) == ("pointer", 7)
    assert user_input.client_time == 123.0
