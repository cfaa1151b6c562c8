"""The one base of errors that are the user's to mend."""


class AppError(Exception):
    """A problem with something the user gave; the message names the value and what is valid."""
