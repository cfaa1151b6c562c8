"""Errors of studies."""

from app.errors import AppError


class StudyError(AppError):
    """A study file, a folder of a study or a request cannot be used; the text says what is."""


class ProtocolError(StudyError):
    """What was asked for does not fit the step the participant is at; nothing was changed."""


class AnswerError(StudyError):
    """An answer is missing or out of range.

    Attributes:
        items: Item → what is wrong, for the page to show beside it.
    """

    def __init__(self, items: dict[str, str]) -> None:
        super().__init__("; ".join(f"{name}: {text}" for name, text in items.items()))
        self.items = items


class StorageError(StudyError):
    """Nothing could be saved just now; asking again later may work."""
