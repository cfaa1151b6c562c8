"""Columns of numbers on their way to the browser: JSON about them, then float32, little-endian.

    uint32 length of the JSON | JSON, padded with spaces to a multiple of 4 | array | array | …

All arrays have `n` numbers and follow in the order of `arrays`, so that the page takes them as
Float32Array views of one buffer, without parsing a digit.
"""

import struct
from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

MEDIA_TYPE = "application/x-hindsight-signals"
MAX_POINTS = 20_000
"""Most points of a curve in one answer; a screen is a tenth as wide, and zooming asks again."""


def pack(meta: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """One answer.

    Args:
        meta: What the page is told about the arrays; gets `arrays` and `n`.
        arrays: Name → numbers, all of the same length.
    """
    n = len(next(iter(arrays.values()))) if arrays else 0
    head = msgspec.json.encode({**meta, "arrays": list(arrays), "n": n})
    head += b" " * (-len(head) % 4)
    columns = [np.ascontiguousarray(array, dtype="<f4").tobytes() for array in arrays.values()]
    return b"".join([struct.pack("<I", len(head)), head, *columns])


def unpack(data: bytes) -> tuple[dict[str, Any], dict[str, npt.NDArray[np.float32]]]:
    """What `pack` was given; the numbers as float32."""
    (length,) = struct.unpack_from("<I", data)
    meta = msgspec.json.decode(data[4 : 4 + length], type=dict[str, Any])
    n, names = meta["n"], meta["arrays"]
    block = np.frombuffer(data, dtype="<f4", offset=4 + length).reshape(len(names), n)
    return meta, dict(zip(names, block, strict=True))


def window(n_steps: int, first: int, last: int) -> tuple[int, int, int]:
    """The steps to send for a wish: first, end (exclusive) and stride.

    Args:
        n_steps: Number of steps of the trial.
        first: First step wanted.
        last: Last step wanted; below zero: to the end.
    """
    first = min(max(first, 0), n_steps - 1)
    end = n_steps if last < 0 else min(max(last, first) + 1, n_steps)
    return first, end, max(1, -(-(end - first) // MAX_POINTS))
