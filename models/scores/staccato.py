"""Staccato: whether two people cut a recording at the same places, corrected for chance by simulation.

Thomann's measure looks only at which segments overlap, not by how much. Segments that all overlap one another, and that
overlap the same other segments, cannot be told apart: together they are a *nucleus*. The segments in nuclei, N, are the
agreement found. Chance puts segments of the same lengths at random places: the mean μ of N over many such draws is what
chance gives. With n segments in all,

    degree of organisation = (N − μ) / (n − μ)

which is 1 where every segment is in a nucleus and 0 at chance. Below chance the divisor is max(n − μ, μ), so that it
never falls under −1.

Between two people who each have no overlaps of their own, a nucleus is a pair of segments that overlap each other and
nothing else. So the measure is strict where segments touch: one border a frame late makes a segment overlap its
neighbour's twin, and two tiers without gaps that agree to a frame everywhere else have no nucleus at all. Give a
tolerance for such tiers, as large as the borders of one person vary when they label twice.

Three choices are mimique's. The scale above is our reading of "degree of organisation", a number between −1 and 1.
Lengths are kept as they are, where Staccato sorts them into a few classes. And a draw keeps the segments of one person
apart, as they are in a tier: the lengths are put in random order, and all ways to share out the free time are equally
likely.

ELAN hands both tiers to the Staccato program (1000 draws, 10 length classes, the latest offset for the length of the
material) and prints what that gives. No published example with all its segments could be read, so this measure is
checked against Thomann's definition of nuclei and against all placements of small cases. Its scale may differ from the
program's: do not print both as one number.

References
----------
A. Lücking, S. Ptock, K. Bergmann, "Assessing agreement on segmentations by means of Staccato, the segmentation
agreement calculator according to Thomann", Gesture Workshop 2011, LNCS 7206. B. Thomann, "Observation and judgment in
psychology: assessing agreement among markings of behavioral events", Behavior Research Methods 33 (2001); his abstract
for Measuring Behavior 2000 states the definition of a nucleus.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .frame_labels import Labels, code_frames, find_runs

__all__ = ["Staccato", "count_nuclei", "staccato"]


@dataclass(frozen=True)
class Staccato:
    """Outcome of :func:`staccato`; ``float(…)`` gives the degree.

    Parameters
    ----------
    degree
        Degree of organisation, −1 to 1; NaN where somebody has no segment, or chance gives the most there can be.
    n_nuclei
        Pairs of segments that overlap each other only.
    n_segments
        Segments of both people.
    expected
        Mean number of segments in nuclei of the random segmentations.
    p_value
        Part of the random segmentations, the real one counted with them, with as many segments in nuclei or more.
    """

    degree: float
    n_nuclei: int
    n_segments: int
    expected: float
    p_value: float

    def __float__(self) -> float:
        return self.degree


def staccato(
    a: Labels, b: Labels, n_simulations: int = 1000, rng: np.random.Generator | None = None, *, tolerance: int = 0
) -> Staccato:
    """Chance-corrected agreement of two segmentations of one take; the labels' names do not matter.

    Parameters
    ----------
    a, b
        ``(n_frames,)``, ``None`` for gaps; a segment is a stretch of one label.
    n_simulations
        Number of random segmentations, at least 1.
    rng
        Where they come from; must be given.
    tolerance
        Overlaps of this many frames or fewer do not count, in the simulations neither. Segments no longer than that
        overlap nothing.

    Raises
    ------
    InputError
        If the lengths differ, the numbers are out of range, or no generator is given.
    """
    if rng is None:
        raise InputError("staccato: expected a random generator (rng), but got none")
    if n_simulations < 1:
        raise InputError(f"n_simulations: expected at least 1, but got {n_simulations}")
    (first, second), _ = code_frames(a, b)
    own, other = find_runs(first)[1:], find_runs(second)[1:]
    n_segments = len(own[0]) + len(other[0])
    n_nuclei = count_nuclei(own, other, tolerance=tolerance)
    lengths = own[1] - own[0], other[1] - other[0]
    drawn = np.array(
        [
            count_nuclei(*(_scatter(some, len(first), rng) for some in lengths), tolerance=tolerance)
            for _ in range(n_simulations)
        ]
    )
    expected = 2 * float(drawn.mean())
    excess = 2 * n_nuclei - expected
    room = n_segments - expected
    if excess < 0:
        room = max(room, expected)
    return Staccato(
        degree=excess / room if room > 0 and all(map(len, lengths)) else float("nan"),
        n_nuclei=n_nuclei,
        n_segments=n_segments,
        expected=expected,
        p_value=float((1 + (drawn >= n_nuclei).sum()) / (1 + n_simulations)),
    )


def count_nuclei(
    a: tuple[NDArray[np.int64], NDArray[np.int64]],
    b: tuple[NDArray[np.int64], NDArray[np.int64]],
    *,
    tolerance: int = 0,
) -> int:
    """Count the pairs of segments of two people that overlap each other and no other.

    Parameters
    ----------
    a, b
        Onsets and offsets (half-open frames), in order, without overlap.
    tolerance
        Overlaps of this many frames or fewer do not count; at least 0.
    """
    if not tolerance >= 0:
        raise InputError(f"tolerance: expected a number of frames, at least 0, but got {tolerance}")
    # A segment no longer than the tolerance overlaps nothing; the borders decide about all others.
    (a_on, a_off), (b_on, b_off) = ((on[off - on > tolerance], off[off - on > tolerance]) for on, off in (a, b))
    if not len(a_on) or not len(b_on):
        return 0
    partner, n_of_a = _overlapped(a_on, a_off, b_on, b_off, tolerance)
    _, n_of_b = _overlapped(b_on, b_off, a_on, a_off, tolerance)
    alone = n_of_a == 1
    return int((n_of_b[partner[alone]] == 1).sum())


def _overlapped(
    on: NDArray, off: NDArray, other_on: NDArray, other_off: NDArray, tolerance: int
) -> tuple[NDArray, NDArray]:
    """First of the others that each segment overlaps, and how many it overlaps: they follow one another."""
    first = np.searchsorted(other_off, on + tolerance, side="right")
    last = np.searchsorted(other_on, off - tolerance, side="left")
    return first, last - first


def _scatter(lengths: NDArray, n_frames: int, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
    """Put segments of these lengths, in any order and without overlap, at random places of the take."""
    shuffled = rng.permutation(lengths)
    free = n_frames - int(shuffled.sum())
    # Segments and free frames in one row, all orders equally likely.
    places = np.sort(rng.choice(free + len(shuffled), len(shuffled), replace=False))
    onsets = places - np.arange(len(shuffled)) + np.cumsum(shuffled) - shuffled
    return onsets, onsets + shuffled
