"""Imported by the forkserver of `hindsight review`: views and computations start at once."""

import app.review.closed_loop
import app.review.open_loop
import app.review.share
import app.review.worker  # noqa: F401
from app.core import warm_up

warm_up()
