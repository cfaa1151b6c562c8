"""What one worker process runs: set up, tell the web process, loop, close the log."""

import contextlib
import logging
import os
import signal
import socket
import sys
from collections.abc import Sequence
from typing import Any

import viser

from app.core import AssistanceSettings, preset
from app.errors import AppError
from app.recording.errors import RecordingError
from app.recording.store import append_event, open_session
from app.robot.scene_file import load_scene
from app.session.autopilot import Driver
from app.session.channel import Channel
from app.session.frame import Frame
from app.session.header import versions
from app.session.hello import hello_message
from app.session.inbox import Inbox
from app.session.loop import HealthMeter, Loop
from app.session.pacing import Pacer
from app.session.readers import LatestReader
from app.session.reasons import Reasons
from app.session.recorder import Recorder
from app.session.session import Session
from app.session.spec import SessionOptions, WorkerSpec, parse_options
from app.session.status import status_message
from app.session.trial import CONTROL_DT_S
from app.session.view_server import view_server
from app.session.viewing import Viewing

SWITCH_INTERVAL_S = 0.0005
"""How long another thread may keep the loop's from the interpreter; Python's default of 5 ms is
half a tick."""

logger = logging.getLogger("hindsight.session")


def main(spec: WorkerSpec, sock: socket.socket, driver: Driver | None = None) -> None:
    """Run one session until it is told to end, its socket closes, or SIGTERM comes.

    Args:
        spec: What to run.
        sock: This end of the socket pair to the web process.
        driver: Steers while no visitor does; None: nobody does.
    """
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    pacer = Pacer(CONTROL_DT_S)
    inbox = Inbox(pacer.wake)
    channel = Channel(sock, inbox.put, inbox.disconnect)
    signal.signal(signal.SIGTERM, lambda *_: inbox.end_soon("The server was stopped."))
    reason = "The simulation failed."
    try:
        channel.start()
        reason = _run(spec, channel, inbox, pacer, driver)
    except AppError as error:
        logger.error("session %s: %s", spec.id, error)
        reason = str(error)
    except MemoryError:
        logger.exception("session %s has no memory", spec.id)
        reason = "This machine has no memory left for the session."
    except Exception:
        logger.exception("session %s failed", spec.id)
    finally:
        channel.send({"type": "ended", "reason": reason})
        channel.close()


def first_settings(spec: WorkerSpec, options: SessionOptions) -> AssistanceSettings:
    """The settings of the first trial.

    Raises:
        CoreError: If a name or value is not valid.
    """
    changes = {name: value for name, value in spec.settings.items() if name != "preset"}
    if options.method:
        changes["method"] = options.method
    return preset(str(spec.settings.get("preset", "default")), **changes)


def _run(
    spec: WorkerSpec, channel: Channel, inbox: Inbox, pacer: Pacer, driver: Driver | None
) -> str:
    """Set up and loop; returns why it ended."""
    options = parse_options(spec.options)
    inbox.delay_s = options.input_delay_s
    settings = first_settings(spec, options)
    scene = load_scene(spec.scene)
    folder = None
    if options.record:
        subject = spec.participant or spec.id
        about = {"versions": versions(), "scene": scene.name, "worker": spec.id}
        folder = open_session(spec.sessions, spec.study, subject, spec.session, about)
        append_event(folder, "worker_start", {"pid": os.getpid()})
    recorder = Recorder(folder)
    session = Session(spec, options, scene, settings, inbox, recorder, channel.send, driver)
    try:
        with view_server() as server:
            _serve(spec, options, session, channel, inbox, pacer, recorder, server)
    finally:
        recorder.close()
        if folder is not None:
            with contextlib.suppress(RecordingError):  # a disk that refuses has been told already
                append_event(folder, "worker_end", {"pid": os.getpid(), "reason": inbox.ended})
    return inbox.ended


def _serve(
    spec: WorkerSpec,
    options: SessionOptions,
    session: Session,
    channel: Channel,
    inbox: Inbox,
    pacer: Pacer,
    recorder: Recorder,
    server: viser.ViserServer,
) -> None:
    """Draw, say that all is ready, and loop."""
    failures = _Failures(channel)
    viewing = Viewing(
        server,
        session.scene,
        theme=options.theme,
        layers=options.layers,
        camera=options.camera,
        hide=options.hide,
        rate_hz=options.viewer_hz,
        show_objects=options.show_objects,
        on_error=failures.tell,
    )
    sender = _Status(channel, viewing, options.hide)
    status = LatestReader("status", sender.send, options.status_hz, failures.tell)
    meter = HealthMeter(CONTROL_DT_S)

    def hello() -> dict[str, Any]:
        return hello_message(
            spec.id,
            session.scene,
            session.view,
            session.trial.settings.method,
            viewing.state.layers,
            recorded=recorder.is_on,
            hold_on_loss=options.hold_on_loss,
            watch=options.watch,
            hide=options.hide,
        )

    session.connect(
        viewing,
        [viewing.offer, status.offer],
        meter.health,
        pacer.restart,
        lambda: channel.send(hello()),
    )
    port = server.get_port()
    channel.send({"type": "ready", "viewer_port": port, "pid": os.getpid(), "hello": hello()})
    try:
        Loop(pacer, meter, session.tick, lambda: inbox.ended != "").run()
    finally:
        # The robot is simulated: with the loop it stops. Its log is closed before all else.
        session.close()
        status.close()
        viewing.close()


class _Status:
    """Makes and sends the status message, in the status reader's thread."""

    def __init__(self, channel: Channel, viewing: Viewing, hide: Sequence[str]) -> None:
        self._channel, self._viewing, self._hide = channel, viewing, hide
        self._reasons = Reasons()

    def send(self, frame: Frame) -> None:
        """Send the status of one frame."""
        view = self._viewing.state
        message = status_message(
            frame,
            layers=view.layers,
            camera=view.camera,
            value_range=view.value_range,
            reasons=self._reasons.update(frame),
            hide=self._hide,
        )
        self._channel.send_status(message)


class _Failures:
    """Says once what fails in a reader's thread; the loop goes on without that reader."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._told: set[str] = set()

    def tell(self, error: Exception) -> None:
        """Log and send an error that was not told before."""
        text = f"{type(error).__name__}: {error}"
        if text not in self._told and len(self._told) < 20:
            self._told.add(text)
            logger.error("a reader of the loop failed", exc_info=error)
            text = f"The view failed: {text}"
            self._channel.send({"type": "notice", "level": "error", "text": text})
