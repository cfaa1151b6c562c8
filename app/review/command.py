"""`hindsight review`: serve the review of a folder until told to stop."""

import getpass
import logging
import sys
import threading
import webbrowser
from pathlib import Path

from app.review.errors import ReviewError
from app.review.folder import ReviewFolder
from app.review.secret import Password, desk_password, write_password
from app.review.server import create_review_app, review_config
from app.web.config import ServerConfig
from app.web.run import HindsightServer, address, bind, serve_until_signal


def review(
    folder: Path,
    *,
    host: str,
    port: int,
    public_origin: str = "",
    password_file: Path | None = None,
    open_browser: bool = False,
) -> None:
    """Serve until SIGINT or SIGTERM.

    Args:
        folder: Any folder that holds logs.
        host: Address to listen on; beyond this machine only behind a TLS proxy and a password.
        port: TCP port; 0: any free one.
        public_origin: Origin of the TLS proxy in front; empty: there is none.
        password_file: Written by `ask_password`; allowed anywhere; behind a
            proxy the password of the desk is asked for where none is named.
        open_browser: Open the page once the server listens.

    Raises:
        AppError: If the folder, an option or the port cannot be used.
    """
    logging.basicConfig(format="%(asctime)s %(name)s %(levelname)s: %(message)s")
    config = review_config(folder, host, port, public_origin)
    password = _password(config, folder, password_file)
    application = create_review_app(config, ReviewFolder(folder), password)
    with bind(config) as listener:
        url = f"{address(config, listener)}/review"
        print(f"Hindsight reviews {folder} at {url}  (Ctrl+C ends it)", flush=True)
        if open_browser:
            threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
        serve_until_signal(HindsightServer(config, application), listener)


def _password(config: ServerConfig, folder: Path, path: Path | None) -> Password | None:
    """What is asked for: beyond this machine always something, on it only what was named."""
    if path is None and config.behind_tls_proxy:
        path = desk_password(folder)
        if path is None:
            raise ReviewError(
                "recorded trials are served beyond this machine behind a password only: the one "
                "of the experimenter's desk (`hindsight study password`), or one of the review's "
                "own: `hindsight review --set-password FILE`, then say --password-file FILE"
            )
    return Password(path) if path is not None else None


def ask_password(path: Path) -> None:
    """Ask for a password at the terminal, or read a line of standard input, and keep its hash.

    Raises:
        ReviewError: If it is not valid or the file cannot be written.
    """
    if sys.stdin.isatty():
        password = getpass.getpass("Password of the review: ")
        if getpass.getpass("Once more: ") != password:
            raise ReviewError("these were two different passwords; nothing was written")
    else:
        password = sys.stdin.readline().rstrip("\n")
    write_password(path, password)
    print(f"Wrote {path}")
