"""Checks at the edge of the core: what comes in is finite, has its shape, and is told by name."""

from typing import Any

import numpy as np

from app.core.errors import CoreError
from app.core.types import Array

SMALLEST_QUATERNION = 1e-6
"""Norm below which a quaternion no longer says which rotation was meant."""


def as_array(value: Any, shape: tuple[int | None, ...], name: str) -> Array:
    """Return `value` as finite, writeable, C-contiguous float64 of `shape` (None: any length).

    Raises:
        CoreError: If it is not numeric, has another shape, or holds NaN or infinity.
    """
    expected = "(" + ", ".join("n" if length is None else str(length) for length in shape)
    expected += ",)" if len(shape) == 1 else ")"
    try:
        array = np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise CoreError(f"{name} must be numbers of shape {expected}, got {value!r}") from error
    fits = array.ndim == len(shape) and all(
        wanted is None or wanted == got for wanted, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise CoreError(f"{name} must have shape {expected}, got {array.shape}")
    if not np.isfinite(array).all():
        raise CoreError(
            f"{name} must be finite, got {array.tolist()} of shape {array.shape}"
            if array.size <= 16
            else f"{name} of shape {array.shape} must be finite, but holds NaN or infinity"
        )
    return array


def as_quaternions(value: Any, shape: tuple[int | None, ...], name: str) -> Array:
    """Return quaternions w x y z scaled to unit length; slightly long or short ones are mended.

    Raises:
        CoreError: As `as_array`, and if a norm is too small to name a rotation.
    """
    array = as_array(value, shape, name)
    norms = np.linalg.norm(array, axis=-1, keepdims=True)
    if array.size and norms.min() < SMALLEST_QUATERNION:
        raise CoreError(
            f"{name} of shape {array.shape} must be rotations (quaternions w x y z of unit norm), "
            f"but one has norm {norms.min():g}"
        )
    return array / norms
