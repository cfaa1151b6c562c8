"""Studies with simulated users: the same assistance, the same tick, the same measures as live."""
