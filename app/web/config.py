"""What the server is told at start, validated once; every number with its unit."""

import argparse
import functools
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from app.errors import AppError
from app.web.capacity import find_capacity

LOOPBACK_HOSTS = ("127.0.0.1", "::1", "localhost")
LIVE_TIMEOUT_S = 300.0
"""A live trial ends after this long [s]: time to look around, and an end for a page left open."""


ATTRACT_ENTRY = "app.simulate.attract:main"
"""What a worker runs where simulated users drive until a visitor does."""


class ConfigError(AppError):
    """A setting of the server is out of range or unsafe."""


@dataclass(frozen=True, kw_only=True)
class ServerConfig:
    """Settings of the web process.

    Attributes:
        host: Address to listen on; beyond loopback only behind a TLS proxy.
        port: TCP port; 0: any free one.
        sessions: Folder that holds all sessions.
        scene: Scene of a new session: a shipped name or a path.
        settings: Changes to the preset, as `WorkerSpec.settings` reads them.
        options: Options every worker is given, as `SessionOptions` reads them.
        study: Study that live sessions are filed under.
        public_origin: Origin of the TLS proxy in front, such as "https://lab.example.org"; empty:
            there is none.
        capacity: Most workers at once; 0: what this machine bears.
        linger_s: A session without a page is ended after this [s].
        status_timeout_s: A worker silent for this long is taken for hung and killed [s].
        ready_timeout_s: Longest start of a worker, kernels compiled anew included [s].
        end_grace_s: How long a worker may take to close its log before it is killed [s].
        starts_per_s: Sustained rate of worker starts [1/s].
        start_burst: Worker starts that may come at once.
        retention_days: Demo sessions older than this are deleted at start; 0: keep [days].
        open_browser: Open the page once the server listens.
        worker_entry: What runs in a worker process, "module:function(spec, socket)".
        preload: Modules the forkserver imports before the first start.
    """

    host: str = "127.0.0.1"
    port: int = 8080
    sessions: Path = Path("sessions")
    scene: str = "default"
    settings: dict[str, Any] = field(default_factory=dict)
    options: dict[str, Any] = field(default_factory=dict)
    study: str = "demo"
    public_origin: str = ""
    capacity: int = 0
    linger_s: float = 60.0
    status_timeout_s: float = 10.0
    ready_timeout_s: float = 120.0
    end_grace_s: float = 10.0
    starts_per_s: float = 1.0
    start_burst: int = 4
    retention_days: float = 0.0
    open_browser: bool = False
    worker_entry: str = "app.session.worker:main"
    preload: tuple[str, ...] = ("app.session.preload",)

    def __post_init__(self) -> None:
        """Validate, so that a bad value is named before anything starts.

        Raises:
            ConfigError: Naming the value and what is valid.
        """
        if not 0 <= self.port <= 65535:
            raise ConfigError(f"port is {self.port}; valid: 0 (any free one) to 65535")
        if not 0 <= self.capacity <= 1000:
            raise ConfigError(f"capacity is {self.capacity}; valid: 0 (by machine) to 1000")
        for name in ("status_timeout_s", "ready_timeout_s", "starts_per_s", "start_burst"):
            _require_above_zero(name, getattr(self, name))
        for name in ("linger_s", "end_grace_s", "retention_days"):
            if not getattr(self, name) >= 0:
                raise ConfigError(f"{name} is {getattr(self, name)}; valid: 0 or more")
        if self.public_origin:
            _require_https_origin(self.public_origin)
        elif self.host not in LOOPBACK_HOSTS:
            raise ConfigError(
                f"host is {self.host!r}: listening beyond this machine without encryption is "
                f"refused; valid: {', '.join(LOOPBACK_HOSTS)}, or any address together with "
                "--behind-tls-proxy https://your.public.name"
            )

    @functools.cached_property
    def max_workers(self) -> int:
        """Most workers at once; where nothing else is said, see `capacity.find_capacity`."""
        return self.capacity or find_capacity().sessions

    @property
    def behind_tls_proxy(self) -> bool:
        """Whether pages are reached over https through a proxy."""
        return bool(self.public_origin)

    @classmethod
    def from_arguments(cls, args: argparse.Namespace) -> "ServerConfig":
        """Settings from the options of `hindsight run`."""
        capacity = 0 if args.capacity is None else args.capacity
        if args.capacity is not None and args.capacity < 1:
            raise ConfigError(f"capacity is {args.capacity}; valid: 1 to 1000")
        return cls(
            host=args.host,
            port=args.port,
            sessions=Path(args.sessions),
            scene=args.scene,
            settings={"preset": args.preset, "method": args.method},
            options={
                "record": not args.no_record,
                "hold_on_loss": args.hold_on_loss,
                "timeout_s": LIVE_TIMEOUT_S,
            },
            public_origin=(args.behind_tls_proxy or "").rstrip("/"),
            capacity=capacity,
            retention_days=args.retention_days or 0.0,
            open_browser=args.open,
            **_ATTRACT if args.attract else {},
        )


_ATTRACT: dict[str, Any] = {
    "worker_entry": ATTRACT_ENTRY,
    "preload": ("app.session.preload", "app.simulate.attract"),
}


def _require_above_zero(name: str, value: float) -> None:
    if not value > 0:
        raise ConfigError(f"{name} is {value}; valid: above 0")


def _require_https_origin(origin: str) -> None:
    parts = urlsplit(origin)
    bare = parts.scheme == "https" and parts.netloc and origin == f"https://{parts.netloc}"
    if not bare or "@" in parts.netloc:
        raise ConfigError(
            f"behind-tls-proxy is {origin!r}; valid: the page's public origin, such as "
            "https://lab.example.org (scheme and name, no path)"
        )
