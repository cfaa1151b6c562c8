"""What one worker runs: trial, loop, viewer drawing, recorder."""
