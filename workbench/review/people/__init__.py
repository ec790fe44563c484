"""Who reviews: accounts with passwords, sessions in the browser, what each person chose."""

from .tables import SCHEMA

__all__ = ["SCHEMA"]
