"""The one versioned file that fixes the simulated corpus, ``parameters.toml``, and how random numbers are drawn."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from ...errors import InputError

PROTOCOLS = ("IE", "SE", "IGE", "EU")
NEUTRAL = "neutral"
TRANSITION = "transition"
UNANNOTATED = "unannotated"

# What a stream of random numbers is for: streams differ, so that drawing more of one never changes another.
STREAMS = ("signer", "script", "instance", "annotator", "timetable", "motion", "face", "head", "camera")


@dataclass(frozen=True)
class Parameters:
    """The sections of ``parameters.toml``; the file says what every number means.

    The sections stay mappings, as they are read: they are written once, in the file, and looked up by name.
    """

    version: str
    rate: int
    affects: list[str]
    regions: list[str]
    codes: Mapping[str, str]
    table: Mapping[str, Any]
    protocols: Mapping[str, Any]
    sentences: list[Mapping[str, Any]]
    poses: Mapping[str, Any]
    confusion: Mapping[str, Any]
    difficulty: Mapping[str, Mapping[str, float]]
    signer: Mapping[str, Any]
    skin: Mapping[str, Any]
    motion: Mapping[str, Any]
    blink: Mapping[str, Any]
    mouthing: Mapping[str, Any]
    grammar: Mapping[str, Any]
    gaze: Mapping[str, Any]
    cheeks: Mapping[str, Any]
    head: Mapping[str, Any]
    camera: Mapping[str, Any]
    annotators: Mapping[str, Any]

    def level(self, difficulty: str) -> Mapping[str, float]:
        """Return the parameters of one difficulty.

        Raises
        ------
        InputError
            If there is no such difficulty.
        """
        if difficulty not in self.difficulty:
            raise InputError(f"difficulty: expected one of {', '.join(self.difficulty)}, but got {difficulty!r}")
        return self.difficulty[difficulty]

    def profile(self, signer: int) -> str:
        """Return the row group of Table B.1 that signer number ``signer`` (from 0) follows."""
        profiles = self.signer["profiles"]
        return str(profiles[signer % len(profiles)])

    def frames(self, seconds: float) -> int:
        """Return the whole number of frames nearest to a time."""
        return round(seconds * self.rate)


@cache
def load_parameters() -> Parameters:
    """Return the parameters that belong to this version of mimique."""
    content = tomllib.loads(files(__package__).joinpath("parameters.toml").read_text(encoding="utf-8"))
    return Parameters(**{field.name: content[field.name] for field in fields(Parameters)})


def random_stream(seed: int, stream: str, *numbers: int) -> np.random.Generator:
    """Return the random numbers of one purpose, for one signer, protocol and take.

    Each purpose has its own, so that a take stays the same however many others are made.

    Parameters
    ----------
    seed
        Of the whole corpus, not negative.
    stream
        One of :data:`STREAMS`.
    numbers
        Signer, protocol and take number, as far as they apply.

    Raises
    ------
    InputError
        If the seed is negative.
    """
    if seed < 0:
        raise InputError(f"seed: expected a whole number from 0, but got {seed}")
    return np.random.default_rng([seed, STREAMS.index(stream), *numbers])
