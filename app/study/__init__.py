"""Studies in the browser: protocol, assignment, survey, storage."""
