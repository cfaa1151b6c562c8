"""`hindsight` and `python -m app`: hand the command line to app.cli and errors to the person."""

import sys

from app.cli import main

if __name__ == "__main__":
    sys.exit(main())
