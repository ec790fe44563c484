"""What to look at next, how fast one is going, and how long people worked."""

from .tables import SCHEMA

__all__ = ["SCHEMA"]
