"""The values that heat maps are made of, checked."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import HeatmapError


def to_unit_range(raw: NDArray[Any]) -> NDArray[np.float32]:
    """Return the values of a heat map in [0, 1], as a fresh array.

    Args:
        raw: numbers; unsigned integers are scaled from their full range, but for masks of 0 and 1.

    Raises:
        HeatmapError: not real numbers, NaN, infinite, negative or above 1.
    """
    if raw.dtype.kind in "bu":
        is_mask = raw.dtype.kind == "b" or raw.max() <= 1
        full = 1 if is_mask else np.iinfo(raw.dtype).max
        return raw.astype(np.float32) / np.float32(full)
    if raw.dtype.kind not in "if":
        raise HeatmapError(f"a heat map holds real numbers, not {raw.dtype}")
    with np.errstate(over="ignore"):  # what is too large becomes infinite
        values = raw.astype(np.float32)
    if not np.isfinite(values).all():
        raise HeatmapError(
            f"the heat map holds {int((~np.isfinite(values)).sum())} NaN or infinite values"
        )
    low, high = float(values.min()), float(values.max())
    if low < 0 or high > 1:
        raise HeatmapError(
            f"heat map values lie in [0, 1], these span {low:g} to {high:g}; "
            "shift and scale them first"
        )
    return values
