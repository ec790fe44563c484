"""Weights learned from markers: sparse online Gaussian processes."""
