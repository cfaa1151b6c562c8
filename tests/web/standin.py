"""A worker process that speaks the boundary's protocol and serves a real viser scene, no robot."""

import json
import os
import signal
import socket
import threading
import time
from typing import Any

import viser

from app.session.spec import WorkerSpec


def main(spec: WorkerSpec, sock: socket.socket) -> None:
    """Answer as `app.session.worker.main` does; `spec.options` chooses a way to fail."""
    fault = spec.options.get("fault", "")
    if fault == "no-start":
        raise SystemExit(3)
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    server.scene.add_box("/hindsight/box", dimensions=(0.1, 0.1, 0.1))
    lock = threading.Lock()
    state: dict[str, Any] = {"input": None, "inputs": 0, "events": [], "rtt": None, "cameras": 0}
    state |= {"clients": {"control": None, "count": 0}, "session": spec.session}

    state["shared"] = 0

    def note_share(**_: Any) -> None:
        state["shared"] += 1

    server.request_share_url = note_share  # type: ignore[method-assign]

    @server.on_client_connect
    def _(client: viser.ClientHandle) -> None:
        @client.camera.on_update
        def _(_: viser.CameraHandle) -> None:
            state["cameras"] += 1

    def send(message: dict[str, Any]) -> None:
        with lock:
            sock.sendall(json.dumps(message).encode() + b"\n")

    def report() -> None:
        while True:
            send({"type": "status", **state, "viewers": len(server.get_clients())})
            time.sleep(1 / 30)

    hello = {"scene": {"name": spec.scene, "objects": []}, "methods": ["direct"], "settings": {}}
    send({"type": "ready", "viewer_port": server.get_port(), "pid": os.getpid(), "hello": hello})
    threading.Thread(target=report, daemon=True).start()
    with sock.makefile("rb") as lines:
        for line in lines:
            message = json.loads(line)
            if message["type"] == "input":
                state["input"] = message
                state["inputs"] += 1
            elif message["type"] == "clients":
                state["clients"] = message
            elif message["type"] == "rtt":
                state["rtt"] = message["ms"]
            elif message["type"] == "event":
                state["events"].append(message["name"])
            elif message["type"] == "command":
                _obey(message, send)
            elif message["type"] == "end" and fault != "deaf":
                send({"type": "ended", "reason": "the session has ended"})
                break
    server.stop()
    sock.close()


def _obey(message: dict[str, Any], send: Any) -> None:
    """Carry out a command; some of them are faults that a test asks for."""
    if message["name"] == "method" and message["method"] == "hang":
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGSTOP)
    elif message["name"] == "method" and message["method"] == "crash":
        os._exit(7)
    elif message["name"] == "method" and message["method"] == "notice":
        send({"type": "notice", "level": "warn", "text": "the disk is full"})
    elif message["name"] == "new-trial":
        scene = {"name": message["scene"], "objects": []}
        send({"type": "hello", "scene": scene, "control": False, "session": "x", "view": "x"})
    send({"type": "ack", "id": message["id"], "client": message["client"], "error": None})
