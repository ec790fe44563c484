"""How sure a label is, and what to review first."""
