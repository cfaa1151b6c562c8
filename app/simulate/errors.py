"""Errors of simulated studies."""

from app.errors import AppError


class SimulateError(AppError):
    """A method, a population or an option of a simulated study is not possible."""
