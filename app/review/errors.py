"""The errors of the review: each says what was asked for and what is valid."""

from app.errors import AppError


class ReviewError(AppError):
    """A trial cannot be shown or computed as asked."""


class OutsideError(ReviewError):
    """A path that does not lie in the reviewed folder."""


class MissingError(ReviewError):
    """Something that was asked for is not there."""


class ConflictError(ReviewError):
    """Somebody else changed the same notes meanwhile."""
