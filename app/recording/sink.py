"""The file behind a running log: append only, retried, never torn by us.

What the disk refuses stays in memory and is offered again. The file holds at all times a prefix
of the log, so whatever happens to the process, the recovery finds every whole chunk in it.
"""

import contextlib
import os
from pathlib import Path

from app.recording.container import Buffer
from app.recording.locks import folder_lock, lock
from app.recording.numbering import FINISHED, UNFINISHED, reserve_locked, trial_name


class FileSink:
    """Owns a trial's `.part` file: opens and locks it, fills it, and gives it its final name.

    Every method raises OSError where the disk refuses and may then be called again. The folder is
    held open, so that a folder that is renamed during a trial keeps its trial.
    """

    def __init__(self, folder: Path, number: int) -> None:
        self.folder = folder
        self.number = number
        self._folder_fd = -1
        self._fd = -1
        self._offset = 0

    @property
    def is_open(self) -> bool:
        """Whether the `.part` file exists and is ours."""
        return self._fd >= 0

    def open(self) -> None:
        """Create and lock the `.part` file; a number that is taken gives way to the next free.

        Under the folder's lock, because between creation and lock a recovery in another process
        would take the file for an orphan.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        with folder_lock(self.folder) as lock_fd:
            if self._exists(UNFINISHED) or self._exists(FINISHED):
                self.number = reserve_locked(self.folder, lock_fd)
            folder_fd = os.open(self.folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
            flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
            try:
                name = trial_name(self.number, UNFINISHED)
                fd = os.open(name, flags, 0o644, dir_fd=folder_fd)
            except OSError:
                os.close(folder_fd)
                raise
            self._fd, self._folder_fd = fd, folder_fd
            lock(fd)

    def take(self, buffer: Buffer) -> None:
        """Append what waits in the buffer; bytes leave it only once they are in the file."""
        while buffer.waiting:
            with memoryview(buffer.waiting)[: 1 << 20] as block:
                count = os.pwrite(self._fd, block, self._offset)
            self._offset += count
            buffer.drop(count)

    def sync(self) -> None:
        """Force the bytes to the disk, and make sure the file is still in its folder.

        Raises:
            FileNotFoundError: If somebody has deleted the file.
        """
        os.fdatasync(self._fd)
        if os.fstat(self._fd).st_nlink == 0:
            raise FileNotFoundError(0, "the log was deleted while it was being written")

    def publish(self) -> Path:
        """Give the finished file its name and make file and name durable.

        Returns:
            Where it is.
        """
        os.fsync(self._fd)
        source, target = trial_name(self.number, UNFINISHED), trial_name(self.number, FINISHED)
        os.rename(source, target, src_dir_fd=self._folder_fd, dst_dir_fd=self._folder_fd)
        os.fsync(self._folder_fd)
        path = self.folder / target
        if path.exists():
            return path
        return Path(os.readlink(f"/proc/self/fd/{self._folder_fd}")) / target  # it was renamed

    def close(self) -> None:
        """Release file, lock and folder; the file stays as it is."""
        for fd in (self._fd, self._folder_fd):
            if fd >= 0:
                with contextlib.suppress(OSError):
                    os.close(fd)
        self._fd = self._folder_fd = -1

    def _exists(self, suffix: str) -> bool:
        return (self.folder / trial_name(self.number, suffix)).exists()
