"""The error of the pure core."""

from app.errors import AppError


class CoreError(AppError):
    """An argument is not valid; the message names it, its shape and what is expected."""
