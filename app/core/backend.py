"""Which implementation of the inner functions this process uses: compiled, or numpy.

Chosen at the first use: compiled where numba works, else numpy with one warning. The environment
variable HINDSIGHT_KERNELS ("auto", "compiled" or "numpy") and `use_kernels` choose otherwise.
"""

import importlib
import os
import warnings
from typing import Literal, Protocol, get_args

from app.core import numpy_backend
from app.core.belief import Evidence
from app.core.errors import CoreError
from app.core.settings import AssistanceSettings
from app.core.types import Array, Goals, Rows

Choice = Literal["auto", "compiled", "numpy"]


class Backend(Protocol):
    """The inner functions; `numpy_backend` documents them."""

    NAME: str

    def evaluate(
        self, settings: AssistanceSettings, goals: Goals, x: Array, rows: Array, best_targets: Rows
    ) -> None:
        """Fill values, costs and gradients."""
        ...

    def update(
        self,
        settings: AssistanceSettings,
        goals: Goals,
        x: Array,
        log_belief: Array,
        log_prior: Array,
        evidence: Evidence,
        rows: Array,
        best_targets: Rows,
        expected_gradient: Array,
    ) -> bool:
        """Evaluate and condition the belief."""
        ...

    def exact_step(
        self, settings: AssistanceSettings, goals: Goals, x: Array, belief: Array, gradient: Array
    ) -> Array:
        """Minimise the policy's objective over the translation."""
        ...

    def fill_grid(
        self,
        settings: AssistanceSettings,
        goals: Goals,
        rotation_values: Array,
        weights: Array,
        start: Array,
        u: Array,
        v: Array,
        temperature: float,
        grid: Array,
    ) -> None:
        """Fill a grid with values."""
        ...


_active: Backend | None = None


def active() -> Backend:
    """Return the backend in use, chosen now if this is the first use."""
    return _active if _active is not None else use_kernels()


def use_kernels(choice: str | None = None) -> Backend:
    """Choose the implementation for this process from now on; return it.

    Args:
        choice: "auto", "compiled", "numpy", or None for what HINDSIGHT_KERNELS says (else "auto").

    Raises:
        CoreError: If the choice is unknown, or "compiled" is asked for and cannot be had.
    """
    global _active
    if choice is None:
        choice = os.environ.get("HINDSIGHT_KERNELS", "auto")
    if choice not in get_args(Choice):
        raise CoreError(f"HINDSIGHT_KERNELS must be one of auto, compiled, numpy, got {choice!r}")
    _active = numpy_backend if choice == "numpy" else _compiled_or_numpy(choice == "compiled")
    return _active


def warm_up() -> str:
    """Compile or load all kernels now; call it before workers are forked.

    Returns:
        "compiled", or "numpy" where numba is missing or fails.
    """
    return active().NAME


def _compiled_or_numpy(must_compile: bool) -> Backend:
    try:
        return importlib.import_module("app.core.compiled_backend")  # type: ignore[return-value]
    except Exception as error:  # numba and LLVM fail in many ways; numpy gives the same numbers
        reason = f"{type(error).__name__}: {error}"
        if must_compile:
            raise CoreError(f"the kernels cannot be compiled ({reason})") from error
        warnings.warn(
            f"kernels are not compiled ({reason}); going on with numpy, about 20 times slower",
            RuntimeWarning,
            stacklevel=3,
        )
        return numpy_backend
