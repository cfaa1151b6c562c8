"""The proxy examples of docs/live.md, run as they stand there but for ports and certificate."""

import contextlib
import re
import shutil
import socket
import ssl
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

import app
from app.web.viewer_page import subprotocol
from tests.web.conftest import Page, Server, StartServer
from tests.web.test_view_messages import pack

DOCS = Path(app.__file__).parent.parent / "docs" / "live.md"
NAME = "lab.example.org"
ORIGIN = f"https://{NAME}"
INSTALLED = [name for name in ("nginx", "caddy") if shutil.which(name)]


def example(language: str) -> str:
    """The configuration in the documentation."""
    blocks = re.findall(rf"```{language}\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 1, f"{len(blocks)} examples of {language}"
    return blocks[0]


def replaced(text: str, changes: dict[str, str]) -> str:
    """The text with each of these parts, which it must have, replaced."""
    for old, new in changes.items():
        assert old in text, f"the example has no {old!r}"
        text = text.replace(old, new)
    return text


def certificate(folder: Path) -> tuple[Path, Path]:
    """A self-signed certificate for the example's name, and its key."""
    paths = folder / "cert.pem", folder / "key.pem"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2"]
    command += ["-subj", f"/CN={NAME}", "-addext", f"subjectAltName=DNS:{NAME}"]
    command += ["-out", str(paths[0]), "-keyout", str(paths[1])]
    subprocess.run(command, check=True, capture_output=True)
    return paths


def command_of(name: str, folder: Path, upstream: str, port: int) -> list[str]:
    """How the proxy is started in front of this server."""
    cert, key = certificate(folder)
    listening = {"127.0.0.1:8080": upstream}
    if name == "nginx":
        listening |= {"listen 443 ssl": f"listen 127.0.0.1:{port} ssl"}
        listening |= {f"/etc/ssl/certs/{NAME}.pem": str(cert)}
        listening |= {f"/etc/ssl/private/{NAME}.key": str(key)}
        temporary = "".join(
            f"{kind}_temp_path {folder}/{kind};"
            for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
        )
        site = replaced(example("nginx"), listening)
        config = f"daemon off; pid {folder}/pid; error_log stderr; events {{}}\n"
        (folder / "nginx.conf").write_text(f"{config}http {{ {temporary}\n{site} }}\n")
        return ["nginx", "-e", "stderr", "-p", str(folder), "-c", f"{folder}/nginx.conf"]
    listening |= {
        f"{NAME} {{": f"https://{NAME}:{port} {{\n    bind 127.0.0.1\n    tls {cert} {key}"
    }
    options = f"admin off\nauto_https disable_redirects\nstorage file_system {folder}"
    site = replaced(example("caddy"), listening)
    (folder / "Caddyfile").write_text(f"{{\n{options}\n}}\n{site}")
    return ["caddy", "run", "--config", f"{folder}/Caddyfile", "--adapter", "caddyfile"]


@contextlib.contextmanager
def proxy(name: str, folder: Path, upstream: str) -> Iterator[int]:
    """A running proxy; its port."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with (folder / "proxy.log").open("w") as log:
        process = subprocess.Popen(
            command_of(name, folder, upstream, port), stdout=log, stderr=subprocess.STDOUT
        )
    try:
        deadline = time.monotonic() + 60
        while True:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1):
                break
            assert process.poll() is None and time.monotonic() < deadline, (
                folder / "proxy.log"
            ).read_text()
            time.sleep(0.1)
        yield port
    finally:
        process.terminate()
        process.wait(30)


def through(port: int, folder: Path, path: str, cookie: str, **options: Any) -> Any:
    """A websocket to the public name, through the proxy."""
    options = {"origin": Origin(ORIGIN), **options}
    return connect(
        f"wss://{NAME}{path}",
        sock=socket.create_connection(("127.0.0.1", port)),
        ssl=ssl.create_default_context(cafile=folder / "cert.pem"),
        server_hostname=NAME,
        additional_headers={"Cookie": cookie},
        compression=None,
        max_size=None,
        proxy=None,
        close_timeout=0.5,
        **options,
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", INSTALLED)
def test_a_session_through_the_documented_proxy(
    start_server: StartServer, tmp_path: Path, name: str
) -> None:
    """The page, its cookie, steering, the picture; and another origin is still refused."""
    server: Server = start_server(public_origin=ORIGIN)
    context = ssl.create_default_context()
    upstream = server.url.removeprefix("http://")
    with proxy(name, tmp_path, upstream) as port:
        context.load_verify_locations(tmp_path / "cert.pem")
        with httpx.Client(verify=context, trust_env=False) as http:
            answer = http.get(
                f"https://127.0.0.1:{port}/",
                headers={"Host": NAME},
                extensions={"sni_hostname": NAME},
            )
        assert answer.status_code == 200, answer.text
        assert f"wss://{NAME}" in answer.headers["content-security-policy"]
        header = answer.headers["set-cookie"]
        assert header.startswith("__Host-hindsight-session=") and "Secure" in header
        cookie = header.split(";")[0]
        session = answer.text.split('hindsight-session" content="')[1].split('"')[0]
        with through(port, tmp_path, f"/input/{session}", cookie) as line:
            page = Page(line)
            assert page.next("hello")["session"] == session
            page.push(1, right=[1.0, 0.0])
            page.status_where(lambda s: s["input"])
            names = [Subprotocol(subprotocol())]
            path = f"/view/{session}"
            with through(port, tmp_path, path, cookie, subprotocols=names) as viewer:
                viewer.send(pack())
                assert len(viewer.recv(60)) > 16
                page.status_where(lambda s: s["viewers"] == 1)
            with pytest.raises(InvalidStatus) as refused:
                through(
                    port, tmp_path, path, cookie, subprotocols=names, origin="https://evil.test"
                )
            assert refused.value.response.status_code == 403


def test_the_examples_say_what_the_server_needs() -> None:
    """Websockets pass, the name passes, nobody's address is written down."""
    nginx, caddy = example("nginx"), example("caddy")
    for part in ("Upgrade $http_upgrade", "Host $http_host", "access_log off", "127.0.0.1:8080"):
        assert part in nginx
    assert "reverse_proxy 127.0.0.1:8080" in caddy
    assert nginx.count("{") == nginx.count("}") and caddy.count("{") == caddy.count("}")
