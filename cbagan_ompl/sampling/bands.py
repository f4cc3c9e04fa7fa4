"""Painting bands around paths: the heat maps of the controls, and the bridges of a repair."""

from __future__ import annotations

from math import ceil, log2, sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from ..maps.grid_map import GridMap

_MIN_HALF_WIDTH = 2.0

# Values below this one are 0, which is so from _REACH half widths on.
_LEAST = 0.01
_REACH = sqrt(-log2(_LEAST))


def half_width(grid: GridMap, fraction: float) -> float:
    """Return a fraction of the longer side of a map, in pixels, at least two."""
    return max(_MIN_HALF_WIDTH, fraction * max(grid.shape))


def paint_band(
    shape: tuple[int, int], path: NDArray[np.float64], half_width: float
) -> NDArray[np.float32]:
    """Paint a polyline of pixel points (M, 2): 1 on it, 0.5 at ``half_width`` pixels from it."""
    band = np.zeros(shape, np.float32)
    window, near = paint_window(shape, path, half_width)
    band[window] = near
    return band


def paint_window(
    shape: tuple[int, int], path: NDArray[np.float64], half_width: float
) -> tuple[tuple[slice, slice], NDArray[np.float32]]:
    """Return rows and columns outside of which a band is 0, and its values in them."""
    corners = np.floor(path).astype(np.int32)
    # Farther away the band is 0: most of a large map need not be looked at.
    reach = ceil(half_width * _REACH) + 1
    left, top = np.maximum(corners.min(axis=0) - reach, 0).tolist()
    right, bottom = np.minimum(corners.max(axis=0) + reach + 1, shape[::-1]).tolist()
    off_path = np.ones((bottom - top, right - left), np.uint8)
    cv2.polylines(off_path, [(corners - (left, top)).reshape(-1, 1, 2)], isClosed=False, color=0)
    distance = cv2.distanceTransform(off_path, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    near = np.exp2(-((distance / np.float32(half_width)) ** 2))
    near[near < _LEAST] = 0
    return (slice(top, bottom), slice(left, right)), near
