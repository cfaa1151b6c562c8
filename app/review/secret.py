"""The password of a review that is served beyond its own machine: kept as a salted scrypt hash.

The line is that of a study's desk (`hindsight study password`), so that experimenters who review
their own study need no second password.
"""

import hashlib
import hmac
import os
import secrets
from pathlib import Path

from app.recording.folders import PRIVATE
from app.review.errors import ReviewError

N, R, P = 2**15, 8, 1
"""Cost of one guess: 32 MiB and about 0.1 s."""
MAX_MEMORY = 128 * 1024 * 1024
MIN_LENGTH, MAX_LENGTH = 10, 1000
DESK = Path(PRIVATE) / "desk.password"
"""Where a folder of sessions keeps the password of its studies' desk."""


def hash_password(password: str) -> str:
    """One line, `scrypt$n$r$p$salt$hash`, from which the password cannot be read.

    Raises:
        ReviewError: If the password is too short or too long.
    """
    if not MIN_LENGTH <= len(password) <= MAX_LENGTH:
        raise ReviewError(
            f"the password has {len(password)} characters; valid: {MIN_LENGTH} to {MAX_LENGTH}"
        )
    salt = secrets.token_bytes(16)
    return "$".join(["scrypt", f"{N}", f"{R}", f"{P}", salt.hex(), _scrypt(password, salt).hex()])


def write_password(path: Path, password: str) -> None:
    """Write a password file that only its owner can read.

    Raises:
        ReviewError: If the password is not valid or the file cannot be written.
    """
    line = hash_password(password)
    try:
        fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(fd, "w") as file:
            os.fchmod(fd, 0o600)
            file.write(line + "\n")
    except OSError as error:
        raise ReviewError(f"cannot write {path}: {error.strerror}") from None


def desk_password(folder: Path) -> Path | None:
    """The password file of the desk whose sessions a folder holds, or is part of."""
    places = (folder.resolve(), *folder.resolve().parents)
    return next((place / DESK for place in places if (place / DESK).is_file()), None)


class Password:
    """A password file that was read once."""

    def __init__(self, path: Path) -> None:
        """Read the file.

        Raises:
            ReviewError: If it is missing or holds no hash.
        """
        try:
            fields = path.read_text(encoding="utf-8").strip().split("$")
            name, n, r, p, salt, kept = fields
            self._cost = (int(n), int(r), int(p))
            self._salt, self._kept = bytes.fromhex(salt), bytes.fromhex(kept)
        except OSError as error:
            raise ReviewError(f"cannot read the password file {path}: {error.strerror}") from None
        except ValueError:
            name = ""
        if name != "scrypt" or not self._kept:
            raise ReviewError(
                f"{path} holds no password hash; write one with "
                f"`hindsight review --set-password {path}`"
            )

    def matches(self, password: str) -> bool:
        """Whether this is the password; takes a tenth of a second, so not for the event loop."""
        if len(password) > MAX_LENGTH:
            return False
        found = _scrypt(password, self._salt, *self._cost)
        return hmac.compare_digest(found, self._kept)


def _scrypt(password: str, salt: bytes, n: int = N, r: int = R, p: int = P) -> bytes:
    data = password.encode("utf-8", "surrogatepass")
    return hashlib.scrypt(data, salt=salt, n=n, r=r, p=p, maxmem=MAX_MEMORY, dklen=32)
