"""Likely mistakes in the tiers that people made, and how well they are found."""
