"""What holds for every test."""

from hypothesis import settings

# The same examples in every run, so that a failure is never a matter of luck; no timed limits.
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.load_profile("fixed")
