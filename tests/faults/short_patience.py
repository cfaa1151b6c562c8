"""Imported by the forkserver of a test: the kernel's timer ends a hung worker after 2 s, not 20."""

from app.web import child

child.HEARTBEAT_S = 0.4
child.DEAD_MAN_S = 2.0
