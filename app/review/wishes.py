"""What a page may ask to be computed, checked before anything starts."""

from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec

from app.core import CoreError, settings_from_dict
from app.review.errors import ReviewError

T = TypeVar("T")


class WhatIfWish(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Other settings, on the logged states or from a moment on."""

    loop: Literal["open", "closed"] = "open"
    """open: on the logged states, along the whole trial. closed: re-simulated from a step on."""
    changes: dict[str, Any] = {}
    """Settings by name; `method` brings its defaults along, as on the live page."""
    step: int = 0
    """First step of a closed loop that differs."""

    @property
    def entry(self) -> str:
        """The job that does it."""
        return f"app.review.{self.loop}_loop:{self.loop}_loop_job"

    @classmethod
    def parse(cls, body: bytes) -> "WhatIfWish":
        """From JSON.

        Raises:
            AppError: Naming the field, its value and what is valid.
        """
        wish = _decode(body, cls)
        if wish.step < 0:
            raise ReviewError(f"step is {wish.step}; valid: 0 or more")
        try:
            settings_from_dict(wish.changes)
        except TypeError as error:
            raise CoreError(f"changes are not valid: {error}") from None
        return wish

    def arguments(self, path: Path) -> dict[str, Any]:
        """For the job."""
        wish: dict[str, Any] = {"path": str(path), "changes": self.changes}
        return wish if self.loop == "open" else {**wish, "first": self.step}


class ShareWish(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One HTML file of a trial."""

    theme: Literal["dark", "light"] = "dark"
    rate_hz: float = 30.0

    @classmethod
    def parse(cls, body: bytes) -> "ShareWish":
        """From JSON; raises ReviewError."""
        wish = _decode(body or b"{}", cls)
        if not 1.0 <= wish.rate_hz <= 60.0:
            raise ReviewError(f"rate_hz is {wish.rate_hz}; valid: 1 to 60")
        return wish

    def arguments(self, path: Path) -> dict[str, Any]:
        """For the job."""
        return {"path": str(path), "theme": self.theme, "rate_hz": self.rate_hz}


def _decode(body: bytes, kind: type[T]) -> T:
    try:
        return msgspec.json.decode(body, type=kind)
    except (ValueError, RecursionError) as error:
        raise ReviewError(f"this cannot be computed: {error}") from None
