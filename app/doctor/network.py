"""Ports: the page's own, and one on loopback for every viewer."""

import json
import socket
import urllib.error
import urllib.request
from collections.abc import Iterator

from app.doctor.finding import Finding
from app.errors import AppError
from app.web.config import ServerConfig
from app.web.run import bind


def check_ports(port: int, host: str = "127.0.0.1") -> Iterator[Finding]:
    """Whether the page's port is free, and loopback can be used at all."""
    try:
        bind(ServerConfig(host=host, port=port)).close()
    except AppError as error:
        running = find_hindsight(port)
        if running:
            yield Finding("Port", "ok", f"{port}: Hindsight {running} is running here already")
        else:
            yield Finding("Port", "warn", str(error), "start with --port 0, or end that program")
    else:
        yield Finding("Port", "ok", f"{port or 'any'} is free")
    yield check_loopback()


def check_loopback() -> Finding:
    """Whether two programs on this machine can talk: pages reach their viewer this way."""
    try:
        with socket.create_server(("127.0.0.1", 0)) as listener:
            address = listener.getsockname()
            with socket.create_connection(address, timeout=5) as near:
                far, _ = listener.accept()
                with far:
                    near.sendall(b"x")
                    works = far.recv(1) == b"x"
    except OSError as error:
        advice = "allow connections to 127.0.0.1 in the firewall or the container's network"
        return Finding("Loopback", "bad", f"it does not work: {error}", advice)
    return Finding("Loopback", "ok" if works else "bad", "works" if works else "loses bytes")


def find_hindsight(port: int) -> str | None:
    """Version of the Hindsight that answers on this port of this machine; None: there is none."""
    try:
        direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        with direct.open(f"http://127.0.0.1:{port}/api/health", timeout=2) as answer:
            return str(json.load(answer)["version"])
    except (OSError, ValueError, KeyError, TypeError, urllib.error.URLError):
        return None
