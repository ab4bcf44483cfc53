"""Arrays of floats, which everything here computes with, and how one that comes from outside is read."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def finite_array(values: ArrayLike, name: str, width: int) -> Array:
    """Return values as a C-ordered float array whose last axis has the given width.

    Raises:
        ValueError: If the last axis has another width or a number is not finite.
    """
    array = np.ascontiguousarray(values, dtype=np.float64)  # has an axis at least
    if array.shape[-1] != width:
        raise ValueError(f"{name} must have shape (..., {width}), not {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite")
    return array
