"""The error of everything that reads or writes sessions."""

from app.errors import AppError


class RecordingError(AppError):
    """A file or folder of recordings cannot be used; the message names it and says why."""


class MessageError(RecordingError):
    """One message of a log cannot be used; whoever knows the file adds its name."""


class NewerFormatError(MessageError):
    """The log is sound, but a newer program wrote it."""
