"""Laws of recording."""
