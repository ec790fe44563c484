"""Simulated signers: recordings of markers with annotations, and the truth behind them.

``parameters.toml`` fixes every number. Anything computed from these recordings should be called simulated.
"""

from .parameters import PROTOCOLS, Parameters, load_parameters
from .recordings import Recording, Truth, simulate_corpus
from .tiers import recording_times

__all__ = [
    "PROTOCOLS",
    "Parameters",
    "Recording",
    "Truth",
    "load_parameters",
    "recording_times",
    "simulate_corpus",
]
