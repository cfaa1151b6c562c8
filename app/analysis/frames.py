"""Types of tables.

pandas annotates nearly every expression as one of `Series | DataFrame | ndarray | …`, which a type
checker cannot follow without a cast a line. So its objects pass as Any here: what columns a table
holds is settled at the edge, in `tables.py`, and said in docstrings.
"""

from typing import Any, TypeAlias

import pandas

pd: Any = pandas

Frame: TypeAlias = Any
"""A pandas.DataFrame."""

Column: TypeAlias = Any
"""A pandas.Series."""
