"""How much every fuzz test may try: a number of examples, so that it is the same everywhere."""

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

SMALL, LARGE = 100, 500
"""Examples where one costs milliseconds (a file, a trial), and where it costs microseconds."""


def budget(examples: int) -> settings:
    """Settings of a fuzz test: so many examples, the same in every run, no limit on time."""
    return settings(
        max_examples=examples,
        deadline=None,
        derandomize=True,
        suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    )


NUMBERS = (
    st.integers(-(2**70), 2**70) | st.floats() | st.sampled_from([0, -0.0, 1, 2**53, 1e308, 5e-324])
)
SCALARS = st.none() | st.booleans() | NUMBERS | st.text(max_size=20)
ANYTHING = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=8,
)
