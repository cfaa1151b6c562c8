"""Imported by the forkserver: what is slow the first time is done once for all workers."""

import app.simulate.trial  # noqa: F401
from app.core import warm_up

warm_up()
