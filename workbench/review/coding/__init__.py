"""Double coding: chosen takes coded by several people blind to each other, their agreement, and its settlement."""

from .tables import SCHEMA

__all__ = ["SCHEMA"]
