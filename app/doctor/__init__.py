"""`hindsight doctor`: what on this machine would spoil a session, and what to do about it."""
