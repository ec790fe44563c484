"""From markers to weights by regression, as Reverdy 2019 does (3.3.1, 3.4.3).

Pairs of marker positions and weights of a range-of-motion take teach a sparse online Gaussian process
(:mod:`.sparse_gaussian_process`) what weights belong to what markers; other takes are then predicted. Before, every
take is centred and scaled by the mean and deviation of each coordinate in *its own actor's* range-of-motion take with
the same markers (3.4.3). That is all that brings one actor's markers to another's: no rig is fitted and no neutral
needed, but the actors' range-of-motion takes must hold much the same motion.

Against :class:`~mimique.synthesis.WeightSolver` this needs known weights to learn from, and knows no bounds: predicted
weights may leave 0..1, and far from all examples they fall back to the mean of the range-of-motion take, or to the
linear trend where one is fitted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import check_array
from ...errors import InputError
from ..layouts.kmeans import STILL
from .kernel_parameters import KernelParameters, fit_kernel_parameters
from .linear_trend import fit_linear_trend
from .sparse_gaussian_process import SparseGaussianProcess

Array = NDArray[np.floating[Any]]

__all__ = ["MarkerRegression", "MarkerScale"]

FORMAT = 1
DOUBT = 0.05
"""Noise that each scaled coordinate, of variance 1, is thought to have of its own where missing ones are inferred."""
LEAST_MARKERS = 4
"""Fewest visible markers from which missing ones are inferred; a quarter of all where that is more."""


@dataclass(frozen=True)
class MarkerScale:
    """Centre and scale of an actor's markers, from a range-of-motion take (3.4.3); make one with :meth:`fit`.

    Parameters
    ----------
    centre, scale
        (n_markers, 3) mm: mean, and deviation or 0.05 mm where that is more. A coordinate that is still thus stays
        near 0 instead of becoming as loud as motion.
    """

    centre: Array
    scale: Array

    @classmethod
    def fit(cls, positions: ArrayLike) -> MarkerScale:
        """Take mean and deviation of (n_frames, n_markers, 3) positions, mm; missing ones (NaN) are left out.

        Raises
        ------
        InputError
            If there are fewer than two frames, a marker is seen in fewer than two of them, or none moves by 0.05 mm.
        """
        values = check_array(positions, name="range-of-motion positions", shape=(None, None, 3))
        seen = np.isfinite(values).all(axis=2).sum(axis=0)
        if len(values) < 2 or values.shape[1] == 0:
            raise InputError(
                f"range-of-motion positions: expected two frames or more of one marker or more, but got {values.shape}"
            )
        if seen.min() < 2:
            raise InputError(
                f"range-of-motion positions: marker {int(seen.argmin())} (from 0) is seen in {int(seen.min())} frames; "
                "expected two or more: leave it out of the layout or take another take"
            )
        whole = np.where(np.isfinite(values).all(axis=2, keepdims=True), values, np.nan)
        deviation = np.nanstd(whole, axis=0)
        if deviation.max() < STILL:
            raise InputError(
                f"range-of-motion positions: the face hardly moves, no coordinate deviates by {STILL} mm; "
                "take another take, or see to the unit"
            )
        return cls(np.nanmean(whole, axis=0), np.maximum(deviation, STILL))

    def __call__(self, positions: ArrayLike) -> Array:
        """Return (n_frames, n_markers, 3) positions in deviations from the mean; NaN stays NaN."""
        values = check_array(positions, name="positions", shape=(None, len(self.centre), 3))
        return (values - self.centre) / self.scale


class MarkerRegression:
    """Weights of an actor's takes from a regression learned on range-of-motion takes; make one with :meth:`fit`.

    Attributes
    ----------
    process : SparseGaussianProcess
        From scaled marker coordinates to centred weights.
    scale : MarkerScale
        Of the actor that it was learned from.
    mean_weights : (n_shapes,)
        Mean weights of the range-of-motion take.
    trend : (3·n_markers, n_shapes)
        Linear map from scaled coordinates to centred weights that the process adds to; 0 without a trend.
    likeness : (3·n_markers, 3·n_markers)
        Covariance of the scaled coordinates, from which missing ones are inferred.
    n_markers, n_shapes : int
    """

    def __init__(
        self, process: SparseGaussianProcess, scale: MarkerScale, mean_weights: Array, trend: Array, likeness: Array
    ) -> None:
        self.process, self.scale, self.mean_weights = process, scale, mean_weights
        self.trend, self.likeness = trend, likeness
        self.n_markers, self.n_shapes = len(scale.centre), len(mean_weights)

    @classmethod
    def fit(
        cls,
        positions: ArrayLike,
        weights: ArrayLike,
        *,
        parameters: KernelParameters | None = None,
        budget: int | None = 300,
        novelty: float | None = None,
        kernel: str = "rbf",
        trend: str = "none",
    ) -> MarkerRegression:
        """Learn from a range-of-motion take whose weights are known.

        Parameters
        ----------
        positions
            (n_frames, n_markers, 3) marker positions of one actor, mm, without head motion. Frames with a missing
            marker (NaN) or weight teach nothing, except mean and deviation of the markers that they show.
        weights
            (n_frames, n_shapes) their weights. They are centred, not scaled: a shape that moves little matters little.
        parameters
            Length scale, amplitude and noise; by default those under which 300 of the frames are most likely.
        budget, novelty, kernel
            Of :class:`.SparseGaussianProcess`.
        trend
            Prior mean ``µ(X)`` of (3.4), which the thesis leaves open. ``none``: the mean weights; ``linear``: a linear
            map (:mod:`.linear_trend`), so that the process learns only what is not linear. It errs clearly less.

        Raises
        ------
        InputError
            If lengths do not fit, fewer than two frames are whole, or the face hardly moves.
        """
        if trend not in ("none", "linear"):
            raise InputError(f"trend: expected none or linear, but got {trend!r}")
        values = check_array(positions, name="range-of-motion positions", shape=(None, None, 3))
        known = check_array(weights, name="range-of-motion weights", shape=(len(values), None))
        scale = MarkerScale.fit(values)
        inputs = scale(values).reshape(len(values), -1)
        whole = np.isfinite(inputs).all(axis=1) & np.isfinite(known).all(axis=1)
        if whole.sum() < 2:
            raise InputError(f"range of motion: expected two frames or more without NaN, but got {int(whole.sum())}")
        inputs, known = inputs[whole], known[whole]
        mean_weights = known.mean(axis=0)
        if np.ptp(known, axis=0).max(initial=0.0) < 1e-6:
            raise InputError("range-of-motion weights: expected weights that change, but they are constant")
        targets = known - mean_weights
        linear = np.zeros((inputs.shape[1], known.shape[1]))
        if trend == "linear":
            linear, _ = fit_linear_trend(inputs, targets, n_folds=min(5, len(inputs)))
            targets = targets - inputs @ linear
        chosen = parameters or fit_kernel_parameters(inputs, targets, kernel=kernel)
        process = SparseGaussianProcess(
            chosen.length_scale,
            amplitude=chosen.amplitude,
            noise=chosen.noise,
            novelty=novelty,
            budget=budget,
            kernel=kernel,
        ).fit(inputs, targets)
        likeness = inputs.T @ inputs / len(inputs)
        return cls(process, scale, mean_weights, linear, likeness)

    def predict(
        self,
        positions: ArrayLike,
        *,
        actor_rom: ArrayLike | MarkerScale | None = None,
        return_std: bool = False,
        missing: str = "infer",
    ) -> Array | tuple[Array, Array]:
        """Return the weights of a take.

        Parameters
        ----------
        positions
            (n_frames, n_markers, 3) the same markers, mm; NaN where one is missing.
        actor_rom
            (n_rom_frames, n_markers, 3) the range-of-motion take of *this* take's actor, or what
            :meth:`MarkerScale.fit` made of it; by default the actor is the one that was learned from.
        return_std
            Whether to return the deviation of the weights too. It knows nothing of markers that were inferred,
            nor of the trend's error.
        missing
            What becomes of frames with missing markers. ``infer``: the missing coordinates are put at their expectation
            given the visible ones, by the covariance of the range-of-motion take; frames with fewer visible markers
            than four, or a quarter of all, get NaN. ``nan``: all of them get NaN.

        Returns
        -------
        (n_frames, n_shapes) weights, not clipped to 0..1; with ``return_std`` twice.

        Raises
        ------
        InputError
            If the number of markers is another, or the range-of-motion take cannot be used.
        """
        if missing not in ("infer", "nan"):
            raise InputError(f"missing: expected infer or nan, but got {missing!r}")
        values = check_array(positions, name="positions", shape=(None, self.n_markers, 3))
        scale = self.scale
        if isinstance(actor_rom, MarkerScale):
            scale = actor_rom
        elif actor_rom is not None:
            scale = MarkerScale.fit(
                check_array(actor_rom, name="range-of-motion positions", shape=(None, self.n_markers, 3))
            )
        inputs: NDArray = scale(values)
        if missing == "infer":
            inputs = self._infer(inputs)
        flat = inputs.reshape(len(inputs), -1)
        usable = np.isfinite(flat).all(axis=1)
        mean, std = np.full((2, len(flat), self.n_shapes), np.nan)
        mean[usable], std[usable] = self.process.predict(flat[usable], return_std=True)
        mean += self.mean_weights
        mean[usable] += flat[usable] @ self.trend
        return (mean, std) if return_std else mean

    def to_arrays(self) -> tuple[dict[str, NDArray], dict[str, Any]]:
        """Return all that makes the model: arrays, and metadata that JSON can hold."""
        arrays, metadata = self.process.to_arrays()
        arrays |= {
            "marker_centre": self.scale.centre,
            "marker_scale": self.scale.scale,
            "mean_weights": self.mean_weights,
            "trend": self.trend,
            "likeness": self.likeness,
        }
        return arrays, {"format": FORMAT, "regression": "sogp"} | metadata

    @classmethod
    def from_arrays(cls, arrays: dict[str, NDArray], metadata: dict[str, Any]) -> MarkerRegression:
        """Return the model that :meth:`to_arrays` described."""
        lacking = [k for k in ("marker_centre", "marker_scale", "mean_weights", "trend", "likeness") if k not in arrays]
        lacking += [k for k in ("format",) if k not in metadata]
        if lacking:
            raise InputError(f"stored marker regression: expected {', '.join(lacking)}, but it is not there")
        if metadata["format"] != FORMAT:
            raise InputError(
                f"stored marker regression: expected format {FORMAT}, but got {metadata['format']}; update mimique"
            )
        process = SparseGaussianProcess.from_arrays(arrays, metadata)
        centre = check_array(arrays["marker_centre"], name="stored marker_centre", shape=(None, 3), finite=True)
        scale = check_array(arrays["marker_scale"], name="stored marker_scale", shape=centre.shape, finite=True)
        n_inputs, n_shapes = process.n_features_in_, process.n_outputs_
        mean = check_array(arrays["mean_weights"], name="stored mean_weights", shape=(n_shapes,), finite=True)
        trend = check_array(arrays["trend"], name="stored trend", shape=(n_inputs, n_shapes), finite=True)
        likeness = check_array(arrays["likeness"], name="stored likeness", shape=(n_inputs, n_inputs), finite=True)
        if centre.size != n_inputs:
            raise InputError(f"stored marker regression: expected {n_inputs // 3} markers, but got {len(centre)}")
        return cls(process, MarkerScale(centre, scale), mean, trend, likeness)

    def _infer(self, inputs: NDArray) -> NDArray:
        """Put missing markers at their expectation; frames with too few visible ones stay as they are."""
        visible = np.isfinite(inputs).all(axis=2)
        least = min(self.n_markers, max(LEAST_MARKERS, -(-self.n_markers // 4)))
        wanting = ~visible.all(axis=1) & (visible.sum(axis=1) >= least)
        out = inputs.copy()
        flat = out.reshape(len(out), -1)
        patterns, group = np.unique(visible[wanting], axis=0, return_inverse=True)
        for number, pattern in enumerate(patterns):
            frames = np.flatnonzero(wanting)[group == number]
            seen = np.repeat(pattern, 3)
            among = self.likeness[np.ix_(seen, seen)] + DOUBT * np.eye(int(seen.sum()))
            known = flat[np.ix_(frames, np.flatnonzero(seen))]
            flat[np.ix_(frames, np.flatnonzero(~seen))] = (
                np.linalg.solve(among, known.T).T @ self.likeness[seen][:, ~seen]
            )
        return out
