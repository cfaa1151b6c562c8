"""viser's own client, read from the installed package, with our style and script put in."""

import functools
import hashlib
from pathlib import Path

import viser

from app.errors import AppError

HERE = Path(__file__).parent


class ViewerPageError(AppError):
    """viser's client is not where, or not what, this version expects."""


def client_folder() -> Path:
    """Folder of viser's built client."""
    return Path(viser.__file__).parent / "client" / "build"


@functools.cache
def viewer_page() -> tuple[bytes, str]:
    """The page and its entity tag; read once.

    Raises:
        ViewerPageError: If the file is missing or has no single `</head>`.
    """
    path = client_folder() / "index.html"
    try:
        html = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ViewerPageError(f"viser's client is missing: {error}") from None
    if html.count("</head>") != 1:
        raise ViewerPageError(f"{path} has {html.count('</head>')} </head>; valid: 1 (viser 1.1)")
    style = (HERE / "viewer_inject.css").read_text(encoding="utf-8")
    script = (HERE / "viewer_inject.js").read_text(encoding="utf-8")
    ours = f"<style>\n{style}</style>\n<script>\n{script}</script>\n"
    page = html.replace("</head>", ours + "</head>").encode()
    return page, f'"{hashlib.sha256(page).hexdigest()[:32]}"'


def subprotocol() -> str:
    """The websocket subprotocol of the installed viser; its server refuses any other."""
    return f"viser-v{viser.__version__}"
