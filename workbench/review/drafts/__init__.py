"""What annotators changed and did not publish yet: operations, drafts with undo and redo, publishing."""

from .tables import SCHEMA

__all__ = ["SCHEMA"]
