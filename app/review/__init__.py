"""Logged trials seen again, and what would have been."""
