"""Errors of the analysis that are the user's to mend."""

from app.errors import AppError


class AnalysisError(AppError):
    """A folder, table or option that cannot be analysed; the message says what is missing."""
