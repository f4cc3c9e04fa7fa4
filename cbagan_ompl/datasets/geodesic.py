"""Lengths of shortest ways on a grid, at any angle.

The eikonal equation |grad D| = 1 on the free pixels, solved by fast sweeping (Zhao, "A fast
sweeping method for eikonal equations", 2005), a first-order scheme.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

# Sweeps end when no distance changes by more than this, in pixels.
_SETTLED = 1e-3
# The distances are exact in a disc without obstacles around the source, at most this wide, where
# the scheme would err most.
_DISC = 12.0


def distances(free: NDArray[np.bool_], source: tuple[int, int]) -> NDArray[np.float32]:
    """Length of the shortest way from a pixel to every other one.

    Args:
        free: (H, W), true where free.
        source: (column, row) of a free pixel.

    Returns:
        (H, W) in pixels, infinite where no 4-connected way leads.
    """
    column, row = source
    padded = np.full((free.shape[0] + 2, free.shape[1] + 2), np.inf, np.float32)
    clearance = cv2.distanceTransform(
        np.pad(free, 1).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
    )
    radius = min(_DISC, float(clearance[row + 1, column + 1]) - 1)
    rows, columns = np.ogrid[-1 : free.shape[0] + 1, -1 : free.shape[1] + 1]
    exact = np.hypot(rows - row, columns - column)
    near = exact <= max(0.0, radius)
    padded[near] = exact[near]
    _sweep(np.pad(free, 1), padded, near)
    return padded[1:-1, 1:-1]


@njit(cache=True)
def _sweep(
    free: NDArray[np.bool_], values: NDArray[np.float32], fixed: NDArray[np.bool_]
) -> None:  # pragma: no cover
    """Gauss-Seidel sweeps in the four diagonal directions until nothing changes."""
    height, width = free.shape
    changed = True
    while changed:
        changed = False
        for direction in range(4):
            down, right = direction < 2, direction % 2 == 0
            for i in range(1, height - 1):
                y = i if down else height - 1 - i
                for j in range(1, width - 1):
                    x = j if right else width - 1 - j
                    if not free[y, x] or fixed[y, x]:
                        continue
                    a = min(values[y, x - 1], values[y, x + 1])
                    b = min(values[y - 1, x], values[y + 1, x])
                    if a > b:
                        a, b = b, a
                    slanted = (a + b + np.sqrt(max(0.0, 2 - (a - b) * (a - b)))) / 2
                    best = slanted if b - a < 1 else a + 1
                    if best < values[y, x] - _SETTLED:
                        values[y, x] = best
                        changed = True
