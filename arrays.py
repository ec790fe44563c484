"""One check for every array that comes from outside."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError


def check_array(
    values: ArrayLike,
    *,
    name: str,
    shape: Sequence[int | None] | None = None,
    finite: bool = False,
    dtype: type | np.dtype = np.float64,
) -> NDArray:
    """Return ``values`` as an array of ``dtype``, or say which expectation it breaks.

    Parameters
    ----------
    values
        Anything that NumPy can turn into an array.
    name
        What the caller calls it; used in the message.
    shape
        Expected length per axis, ``None`` for any: ``(None, 3)`` is a list of points.
    finite
        Whether NaN and infinity are refused.
    dtype
        Type of the result.

    Raises
    ------
    InputError
        If the values are not numbers, or have another shape, or are not finite.
    """
    try:
        array = np.asarray(values, dtype=dtype)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: expected numbers, but got {type(values).__name__} ({error})") from error
    if shape is not None:
        fits = array.ndim == len(shape) and all(
            want is None or want == got for want, got in zip(shape, array.shape, strict=True)
        )
        if not fits:
            expected = "(" + ", ".join("any" if n is None else str(n) for n in shape) + ")"
            raise InputError(f"{name}: expected shape {expected}, but got {array.shape}")
    if finite and not np.isfinite(array).all():
        first = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InputError(f"{name}: expected finite numbers, but the entry at {first} is {array[first]}")
    return array
