"""Commands at the edge, and their way through a channel: checked, in order, never lost."""

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from app.session.channel import MAX_LINE_BYTES, Channel, Message
from app.session.commands import COMMANDS, CommandError, parse_command
from app.session.inbox import Inbox
from app.session.spec import SpecError, parse_options


@pytest.mark.parametrize(
    ("message", "text"),
    [
        ({"name": "dance"}, "'dance' is unknown; valid: start, grasp"),
        ({"name": ["grasp"]}, "is unknown"),
        ({}, "None is unknown"),
        ({"name": "grasp", "force": 9}, "grasp has no field 'force'; valid: none"),
        ({"name": "method"}, "method needs method"),
        ({"name": "method", "method": 3}, "method is 3; valid: a text"),
        ({"name": "method", "method": "x" * 300}, "valid: a text of 1 to 200"),
        ({"name": "assist", "enabled": 1}, "enabled is 1; valid: true or false"),
        ({"name": "settings", "changes": {}}, "valid: an object of plain values"),
        ({"name": "settings", "changes": {"gain": [1]}}, "valid: an object of plain values"),
        ({"name": "settings", "changes": {"gain": float("nan")}}, "plain values"),
        ({"name": "new-trial", "seed": -1}, "seed is -1"),
        ({"name": "new-trial", "seed": True}, "seed is True"),
        ({"name": "theme", "theme": "pink"}, "theme is 'pink'; valid: dark or light"),
    ],
)
def test_bad_commands_name_value_and_valid_ones(message: dict[str, Any], text: str):
    """Unknown names and fields, missing fields, wrong types."""
    with pytest.raises(CommandError, match=text):
        parse_command({"type": "command", "client": "c1", "id": 1, **message})


def test_good_commands_keep_their_fields():
    """Fields that are null count as left out; sender and number are kept for the ack."""
    command = parse_command(
        {"type": "command", "client": "c1", "id": 4, "name": "new-trial", "seed": 0, "target": None}
    )
    assert (command.name, dict(command.args)) == ("new-trial", {"seed": 0})
    assert (command.client, command.id) == ("c1", 4)
    assert {"start", "grasp", "open", "hold"} <= set(COMMANDS)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"recrod": True}, "option 'recrod' is unknown; valid: record"),
        ({"start": "never"}, "start is 'never'"),
        ({"viewer_hz": 0}, "viewer_hz is 0; valid: a number from 1 to 100"),
        ({"timeout_s": float("nan")}, "timeout_s is nan"),
        ({"seed": -3}, "seed is -3"),
        ({"hide": ["everything"]}, "hide is"),
        ({"theme": "pink"}, "theme is 'pink'"),
    ],
)
def test_bad_options_name_value_and_valid_ones(options: dict[str, Any], text: str):
    """Options of a spec are checked before anything starts."""
    with pytest.raises(SpecError, match=text):
        parse_options(options)


class Pair:
    """A channel and the other end of its socket."""

    def __init__(self) -> None:
        self.far, near = socket.socketpair()
        self.received: list[Message] = []
        self.closed = threading.Event()
        self.channel = Channel(near, self.received.append, self.closed.set)
        self.channel.start()
        self.lines = self.far.makefile("rb")

    def read(self) -> Message:
        """The next message of the channel."""
        return json.loads(self.lines.readline())


@pytest.fixture
def pair() -> Iterator[Pair]:
    """A running channel, closed at the end."""
    pair = Pair()
    yield pair
    pair.channel.close()
    pair.lines.close()
    pair.far.close()


def until(condition: Callable[[], bool]) -> None:
    """Wait for another thread."""
    while not condition():
        time.sleep(0.001)


def test_messages_arrive_whole_and_in_order(pair: Pair):
    """However the bytes are cut; what is no message is dropped and counted."""
    text = b"".join(json.dumps({"type": "command", "id": i}).encode() + b"\n" for i in range(300))
    for start in range(0, len(text), 7):
        pair.far.sendall(text[start : start + 7])
    pair.far.sendall(b"{broken\n[1]\n\n" + b'{"type":"last"}\n')
    until(lambda: len(pair.received) == 301)
    assert [m.get("id") for m in pair.received[:300]] == list(range(300))
    assert pair.received[-1] == {"type": "last"}
    assert pair.channel.malformed == 2


def test_an_endless_line_costs_bounded_memory(pair: Pair):
    """It is skipped to its end, and the next message arrives."""
    for _ in range(40):
        pair.far.sendall(b"x" * (MAX_LINE_BYTES // 4))
    pair.far.sendall(b'"}\n{"type":"after"}\n')
    until(lambda: len(pair.received) == 1)
    assert pair.received == [{"type": "after"}]
    assert pair.channel.malformed >= 1


def test_acks_queue_and_status_is_replaced_while_nobody_reads(pair: Pair):
    """Offering never blocks; once read, all acks are there and the status is the newest."""
    start = time.monotonic()
    for i in range(2000):
        pair.channel.send_status({"type": "status", "n": i, "filling": "x" * 2000})
        pair.channel.send({"type": "ack", "id": i})
    assert time.monotonic() - start < 30.0  # four megabytes that nobody reads
    acks, last = [], -1
    while len(acks) < 2000 or last < 1999:
        message = pair.read()
        if message["type"] == "ack":
            acks.append(message["id"])
        else:
            assert message["n"] > last
            last = message["n"]
    assert acks == list(range(2000))


def test_a_closed_socket_is_told_once(pair: Pair):
    """The other side's end is noticed at once; sending then does no harm."""
    pair.lines.close()
    pair.far.close()
    assert pair.closed.wait(10)
    pair.channel.send({"type": "ack", "id": 1})
    pair.channel.send_status({"type": "status"})


def test_close_sends_what_is_queued():
    """The last word arrives although the channel closes right after."""
    pair = Pair()
    for i in range(50):
        pair.channel.send({"type": "notice", "n": i})
    pair.channel.send({"type": "ended", "reason": "done"})
    pair.channel.close()
    messages = [json.loads(line) for line in pair.lines]
    assert messages[-1] == {"type": "ended", "reason": "done"}
    assert len(messages) == 51
    pair.lines.close()
    pair.far.close()


def test_the_inbox_loses_no_command_under_a_flood_of_input():
    """Inputs replace one another; everything else stays in order, and wakes the loop."""
    woken: list[int] = []
    inbox = Inbox(lambda: woken.append(1))
    inbox.put({"type": "clients", "control": "c1", "count": 1})
    sent = []
    for i in range(1000):
        message = {"type": "input", "client": "c1", "seq": i, "t": 10.0 * i, "right": [0.5, 0.5]}
        inbox.put(message)
        if i % 3 == 0:
            sent.append({"type": "command", "client": "c1", "id": i, "name": "hold"})
            inbox.put(sent[-1])
    taken = inbox.take()
    assert taken[1:] == sent
    assert inbox.take() == []
    assert inbox.gate.current(time.monotonic())[0].sequence == 999
    assert len(woken) >= len(sent)
    inbox.put({"type": "rtt", "ms": 12.5})
    assert inbox.round_trip_ms == 12.5
    inbox.put({"type": "end"})
    inbox.disconnect()
    assert inbox.ended == "The session has ended."
