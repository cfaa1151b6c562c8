"""Hindsight: shared-autonomy teleoperation by hindsight optimization, in the browser."""

__version__ = "0.1.0"
