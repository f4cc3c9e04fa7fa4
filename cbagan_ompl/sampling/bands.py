"""Painting bands around paths: the heat maps of the controls, and the bridges of a repair."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..maps.grid_map import GridMap

_MIN_HALF_WIDTH = 2.0


def half_width(grid: GridMap, fraction: float) -> float:
    """Return a fraction of the longer side of a map, in pixels, at least two."""
    return max(_MIN_HALF_WIDTH, fraction * max(grid.shape))


def paint_band(
    shape: tuple[int, int], path: NDArray[np.float64], half_width: float
) -> NDArray[np.float32]:
    """Paint a polyline of pixel points (M, 2): 1 on it, 0.5 at ``half_width`` pixels from it."""
    off_path = np.ones(shape, np.uint8)
    corners = np.floor(path).astype(np.int32).reshape(-1, 1, 2)
    cv2.polylines(off_path, [corners], isClosed=False, color=0)
    distance = cv2.distanceTransform(off_path, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    band: NDArray[np.float32] = np.exp2(-((distance / np.float32(half_width)) ** 2))
    return np.where(band < 0.01, np.float32(0), band)
