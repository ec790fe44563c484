"""Head stabilisation: the motion of the skull is taken out of a take (Reverdy 2019, 5.2.1).

The Q head markers sit where the skin does not move (skull, temples), so their mutual distances are constant. In each
frame the least-squares rotation ``R`` and translation ``t`` that bring a reference of the head markers onto the visible
ones give the pose of the head, and its inverse, applied to all markers, leaves what the face does:

    positions = Rᵀ (recorded − t)

Three visible head markers that are not collinear fix a pose; with fewer the frame is NaN, and not usable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import check_array
from ..errors import InputError
from ..rigid import fit_rigid

__all__ = ["Stabilised", "fit_head_reference", "stabilise"]

# Head markers nearer than this part of the reference's extent are taken for one: on a head about a millimetre.
COINCIDENT = 5e-3
MAX_TEMPLATE_FRAMES = 2000
MAX_ITERATIONS = 50
# Distances beyond this multiple of a marker's median distance from the reference count less.
HUBER = 1.5


@dataclass(frozen=True)
class Stabilised:
    """A take without head motion, and the head motion.

    Parameters
    ----------
    positions
        All markers, ``(n_frames, n_markers, 3)`` in mm; NaN where missing, and everywhere in unusable frames.
    rotation
        ``(n_frames, 3, 3)``; the head's pose, ``recorded = positions @ rotation.T + translation``.
    translation
        ``(n_frames, 3)`` in mm.
    rmse
        ``(n_frames,)`` in mm: how far the visible head markers are from the reference, as root mean square.
    usable
        ``(n_frames,)`` bool: at least three head markers were visible and not collinear.
    reference
        ``(n_head, 3)`` in mm: the head markers that every frame was aligned to; pass it on to bring other takes of the
        same signer and session into the same pose.
    """

    positions: NDArray[np.float64]
    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]
    rmse: NDArray[np.float64]
    usable: NDArray[np.bool_]
    reference: NDArray[np.float64]

    @property
    def n_unusable(self) -> int:
        """Number of frames in which the head was not seen well enough."""
        return int((~self.usable).sum())


def stabilise(
    positions: ArrayLike,
    head: Sequence[int],
    reference: ArrayLike | None = None,
    *,
    names: Sequence[str] | None = None,
) -> Stabilised:
    """Remove rotation and translation of the head from every frame.

    Parameters
    ----------
    positions
        Recorded markers, ``(n_frames, n_markers, 3)`` in mm, NaN where missing.
    head
        Indices of the head markers; at least three.
    reference
        Positions of the head markers to align to, ``(n_head, 3)`` in the order of `head`, NaN for those to leave out;
        by default :func:`fit_head_reference` of this take.
    names
        Of all markers, for messages; their indices otherwise.

    Raises
    ------
    InputError
        If fewer than three head markers are usable, if two of them coincide, or if they lie on one line.
    """
    recorded = check_array(positions, name="positions", shape=(None, None, 3))
    indices = _check_head(head, recorded.shape[1])
    seen = recorded[:, indices]
    if reference is None:
        reference = fit_head_reference(seen)
    template = check_array(reference, name="reference", shape=(len(indices), 3))
    _check_reference(template, [str(i if names is None else names[i]) for i in indices])
    pose = fit_rigid(template[None], seen)
    moved = (recorded - pose.translation[:, None]) @ pose.rotation  # row vectors: this is Rᵀ (x − t)
    return Stabilised(moved, pose.rotation, pose.translation, pose.rms, pose.valid, template)


def fit_head_reference(seen: ArrayLike) -> NDArray[np.float64]:
    """Typical shape of a take's head markers, in the take's typical pose.

    The frames are aligned to a first guess and replaced by their mean, and so on until the mean stays (generalised
    Procrustes analysis). The mean is Huber's: frames in which a marker is farther away than usual count in inverse
    proportion to that distance, so that a slipped or swapped marker in some frames does not bend the reference, and
    turning the recording turns the result. The first guess is the frame whose mutual distances are nearest to the
    take's median distances, among those with most markers; a marker that is hidden there joins as soon as other frames
    place it. Long takes are sampled evenly down to 2000 frames. The reference is then turned to the mean orientation
    and moved to the mean place of the head in the take, so that stabilised markers stay about where they were recorded.

    Parameters
    ----------
    seen
        Head markers, ``(n_frames, n_head, 3)`` in mm, NaN where missing.

    Returns
    -------
    ``(n_head, 3)`` in mm; NaN for a marker that is never seen together with three others.
    """
    frames = check_array(seen, name="head markers", shape=(None, None, 3))
    visible = np.isfinite(frames).all(axis=2)
    enough = np.flatnonzero(visible.sum(axis=1) >= 3)
    if len(enough) == 0:
        raise InputError(
            f"head markers: expected a frame with at least three visible, but got none in {len(frames)} frames"
        )
    if len(enough) > MAX_TEMPLATE_FRAMES:
        enough = enough[np.linspace(0, len(enough) - 1, MAX_TEMPLATE_FRAMES).round().astype(int)]
    frames, visible = frames[enough], visible[enough]

    template = _most_typical_frame(frames, visible)
    extent = np.nanmax(np.nanmax(template, axis=0) - np.nanmin(template, axis=0))
    for _ in range(MAX_ITERATIONS):
        pose = fit_rigid(template[None], frames)
        updated = _huber_mean(pose.inverse().apply(frames), template)
        # A marker that joins only now must not end the iteration by having no earlier position to differ from.
        joined = np.isnan(template).any(axis=1) & np.isfinite(updated).all(axis=1)
        change = np.abs(updated - template)[~np.isnan(updated - template)]
        template = updated if pose.valid.any() else template
        if not joined.any() and change.max(initial=0.0) <= 1e-6 * extent:
            break

    pose = fit_rigid(template[None], frames)
    if not pose.valid.any():
        return template
    u, _, vt = np.linalg.svd(np.nanmean(pose.rotation, axis=0))
    mean_rotation = (u * [1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    centre = np.nanmean(template, axis=0)
    typical_place = np.nanmean(pose.apply(centre[None, None])[:, 0], axis=0)
    return (template - centre) @ mean_rotation.T + typical_place


def _most_typical_frame(frames: NDArray, visible: NDArray) -> NDArray:
    """Give the frame nearest to the median mutual distances among those with most markers."""
    best = np.flatnonzero(visible.sum(axis=1) == visible.sum(axis=1).max())
    distances = np.linalg.norm(frames[:, :, None] - frames[:, None], axis=3)
    upper = np.triu_indices(frames.shape[1], k=1)
    flat = distances[:, upper[0], upper[1]]
    together = np.isfinite(flat).any(axis=0)
    typical = np.zeros(flat.shape[1])
    typical[together] = np.nanmedian(flat[:, together], axis=0)
    deviation = np.where(np.isfinite(flat), np.abs(flat - typical), 0.0).mean(axis=1)
    return frames[best[np.argmin(deviation[best])]]


def _huber_mean(aligned: NDArray, template: NDArray) -> NDArray:
    """One step towards Huber's mean of each marker over frames; NaN where a marker is never seen."""
    result = np.full(template.shape, np.nan)
    for marker, points in enumerate(np.swapaxes(aligned, 0, 1)):
        points = points[np.isfinite(points).all(axis=1)]
        if not len(points):
            continue
        if np.isnan(template[marker]).any():
            result[marker] = np.median(points, axis=0)
            continue
        distance = np.linalg.norm(points - template[marker], axis=1)
        limit = HUBER * np.median(distance)
        weight = np.where(distance > limit, limit / np.where(distance > limit, distance, 1.0), 1.0)
        if weight.sum() > 0:
            result[marker] = weight @ points / weight.sum()
        else:
            result[marker] = template[marker]
    return result


def _check_head(head: Sequence[int], n_markers: int) -> list[int]:
    indices = [int(i) for i in head]
    if len(set(indices)) != len(indices):
        raise InputError(f"head: expected each head marker once, but got {indices}")
    if len(indices) < 3:
        raise InputError(f"head: expected at least three head markers, but got {len(indices)}")
    outside = [i for i in indices if not 0 <= i < n_markers]
    if outside:
        raise InputError(f"head: expected marker indices from 0 to {n_markers - 1}, but got {outside}")
    return indices


def _check_reference(template: NDArray, names: list[str]) -> None:
    """Refuse head markers that cannot fix a pose in any frame."""
    known = np.flatnonzero(np.isfinite(template).all(axis=1))
    if len(known) < 3:
        raise InputError(
            f"head markers: expected at least three usable ones, but got {len(known)} "
            f"of {', '.join(names)}; name others"
        )
    points = template[known] - template[known].mean(axis=0)
    extents = np.linalg.svd(points, compute_uv=False)
    gaps = np.linalg.norm(points[:, None] - points[None], axis=2) + np.where(np.eye(len(points)), np.inf, 0)
    i, j = np.unravel_index(np.argmin(gaps), gaps.shape)
    if gaps[i, j] <= COINCIDENT * extents[0]:
        pair = names[known[i]], names[known[j]]
        raise InputError(f"head markers: expected distinct places, but the markers {pair[0]} and {pair[1]} coincide")
    if extents[1] <= 1e-2 * extents[0]:
        raise InputError(
            f"head markers: expected three that are not on one line, but "
            f"{', '.join(names[k] for k in known)} are; add one off the line"
        )
