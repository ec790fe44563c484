"""What a picture of a performance shows, and from where."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import InputError

MARKER_PLACES = ("overlay", "beside", "none")
MARKER_KINDS = ("raw", "adapted", "fitted", "residuals")
HEATS = ("displacement", "residual")
CAMERAS = {"front": 0.0, "three-quarter": 40.0, "side": 90.0}
"""Camera by name: degrees from straight ahead round the head, towards the subject's left."""


@dataclass(frozen=True)
class View:
    """What is shown of a performance.

    Parameters
    ----------
    markers
        Where markers are: over the skin (``overlay``), in a picture of their own (``beside``) or nowhere (``none``).
    show
        Which markers: ``raw`` as stabilised, ``adapted`` to the rig, ``fitted`` as the weights place them, and
        ``residuals``, lines from adapted to fitted. What a performance does not have is not shown.
    heat
        What colours the skin, in mm: ``displacement`` from the neutral, ``residual`` of the markers, or None.
    camera
        One of :data:`CAMERAS`.
    curves
        Whether the panel with the labels and the timeline with tiers and curves are there.

    Raises
    ------
    InputError
        If a word is none of these.
    """

    markers: str = "overlay"
    show: tuple[str, ...] = ("adapted",)
    heat: str | None = None
    camera: str = "front"
    curves: bool = True

    def __post_init__(self) -> None:
        _check("markers", self.markers, MARKER_PLACES)
        for kind in self.show:
            _check("show", kind, MARKER_KINDS)
        if self.heat is not None:
            _check("heat", self.heat, HEATS)
        _check("camera", self.camera, tuple(CAMERAS))


def _check(what: str, word: str, words: tuple[str, ...]) -> None:
    if word not in words:
        raise InputError(f"{what}: expected {', '.join(words[:-1])} or {words[-1]}, but got {word!r}")
