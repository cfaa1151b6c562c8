"""The experimenter's password: kept as a scrypt hash, set on the command line."""

import getpass
import hashlib
import hmac
import os
import secrets
import sys
from pathlib import Path

from app.recording.folders import PRIVATE
from app.study.errors import StudyError

FILE = "desk.password"
ENVIRONMENT = "HINDSIGHT_DESK_PASSWORD"
LEAST = 10
_N, _R, _P = 2**15, 8, 1


def hash_password(password: str) -> str:
    """`scrypt$n$r$p$salt$hash`, 32 MB and about 0.1 s a guess."""
    salt = secrets.token_bytes(16)
    return f"scrypt${_N}${_R}${_P}${salt.hex()}${_derive(password, salt, _N, _R, _P).hex()}"


def check_password(password: str, kept: str) -> bool:
    """Whether this is the password of a hash; False for a damaged hash."""
    try:
        kind, n, r, p, salt, digest = kept.strip().split("$")
        found = _derive(password, bytes.fromhex(salt), int(n), int(r), int(p))
        return kind == "scrypt" and hmac.compare_digest(found, bytes.fromhex(digest))
    except ValueError:
        return False


def read_hash(sessions: Path) -> str:
    """The hash of this folder of sessions; empty where no password was set."""
    try:
        return (sessions / PRIVATE / FILE).read_text(encoding="utf-8").strip()
    except FileNotFoundError:
        return ""


def set_password(sessions: Path) -> int:
    """Ask for a password (or take it from the environment), and keep its hash.

    Raises:
        StudyError: If it is too short, the two entries differ, or it cannot be written.
    """
    password = os.environ.get(ENVIRONMENT, "")
    if not password and sys.stdin.isatty():
        password = getpass.getpass("Password for the experimenter's desk: ")
        if password != getpass.getpass("Once more: "):
            raise StudyError("the two entries differ")
    elif not password:
        password = sys.stdin.readline().rstrip("\n")
    if len(password) < LEAST:
        raise StudyError(f"{len(password)} characters; valid: at least {LEAST}")
    folder = sessions / PRIVATE
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.chmod(folder, 0o700)
        fd = os.open(folder / FILE, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(fd, "w") as file:
            file.write(hash_password(password) + "\n")
    except OSError as error:
        raise StudyError(f"cannot write to {folder}: {error.strerror}") from None
    print(f"The password's hash is in {folder / FILE}")
    return 0


def _derive(password: str, salt: bytes, n: int, r: int, p: int) -> bytes:
    if not (2 <= n <= 2**20 and 1 <= r <= 32 and 1 <= p <= 16):
        raise ValueError("cost out of range")
    limit = 128 * n * r * p + 2**20
    return hashlib.scrypt(password.encode(), salt=salt, n=n, r=r, p=p, maxmem=limit, dklen=32)
