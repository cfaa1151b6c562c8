"""What identifies people: in `<sessions>/private/<study>/`, readable by its owner only.

One file a participant, `p0001.json`: recruitment parameters, consent, digests of tokens and codes,
free text. Never exported; deleted with a withdrawal.
"""

import contextlib
import hashlib
import os
import secrets
from pathlib import Path
from typing import Any

import msgspec

from app.recording.folders import PRIVATE, write_json
from app.study.errors import StorageError, StudyError

KEY_FILE = "server.key"


def digest(secret: str) -> str:
    """What is kept of a token or code."""
    return hashlib.sha256(secret.encode()).hexdigest()


class PrivateFolder:
    """Owns the private folder of one study."""

    def __init__(self, sessions: Path, study: str) -> None:
        """Make the folder.

        Raises:
            StudyError: If it cannot be made.
        """
        self.path = sessions / PRIVATE / study
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            for folder in (self.path.parent, self.path):
                os.chmod(folder, 0o700)
        except OSError as error:
            raise StudyError(f"cannot use {self.path}: {error.strerror}") from None

    def key(self) -> bytes:
        """A secret of this server that outlives it, for signing."""
        path = self.path / KEY_FILE
        with contextlib.suppress(FileNotFoundError):
            return bytes.fromhex(path.read_text().strip())
        key = secrets.token_bytes(32)
        self.write_text(KEY_FILE, key.hex() + "\n")
        return key

    def read(self, participant: str) -> dict[str, Any]:
        """What is known of a participant; empty where there is nothing."""
        try:
            return msgspec.json.decode((self.path / f"{participant}.json").read_bytes())
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, RecursionError) as error:
            raise StorageError(f"private file of {participant}: {error}") from None

    def update(self, participant: str, changes: dict[str, Any]) -> None:
        """Add to what is known, durably.

        Raises:
            StorageError: If it cannot be written.
        """
        path = self.path / f"{participant}.json"
        known = {**self.read(participant), **changes}
        try:
            write_json(path, known)
            os.chmod(path, 0o600)
        except OSError as error:
            raise StorageError(f"cannot write to {self.path}: {error.strerror}") from None

    def forget(self, participant: str) -> bool:
        """Delete all that is known of a participant; whether there was anything."""
        paths = list(self.path.glob(f"{participant}.*"))  # their file, and notes on them
        for path in paths:
            path.unlink()
        return bool(paths)

    def write_text(self, name: str, text: str) -> None:
        """Write a small file that only its owner may read."""
        path = self.path / name
        temporary = path.with_name(f".{name}.new")
        try:
            fd = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
            with os.fdopen(fd, "w") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, path)
        except OSError as error:
            raise StorageError(f"cannot write {path}: {error.strerror}") from None

    def append(self, name: str, line: dict[str, Any]) -> None:
        """Append one line of JSON to a file of this folder, durably."""
        data = msgspec.json.encode(line) + b"\n"
        try:
            flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND
            fd = os.open(self.path / name, flags, 0o600)
            try:
                os.write(fd, data)
                os.fsync(fd)
            finally:
                os.close(fd)
        except OSError as error:
            raise StorageError(f"cannot write {self.path / name}: {error.strerror}") from None
