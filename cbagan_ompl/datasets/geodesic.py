"""Geodesic distances on a grid: lengths of shortest paths at any angle.

The distance D from a source solves the eikonal equation |grad D| = 1 on the free pixels. It is
solved by fast sweeping, a first-order scheme: H. Zhao, "A fast sweeping method for eikonal
equations", Mathematics of Computation 74, 2005, https://doi.org/10.1090/S0025-5718-04-01678-3.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled

# Sweeps end when no distance changes by more than this, in pixels.
_TOLERANCE = 1e-3
# The scheme errs most beside the source. So distances are set exactly in a disc without obstacles
# around it, whose radius in pixels is at most this.
_EXACT_RADIUS = 12.0


def distance_field(free: NDArray[np.bool_], source: tuple[int, int]) -> NDArray[np.float32]:
    """Return the length of the shortest path from a pixel to every other one.

    Args:
        free: (H, W), true where free.
        source: (column, row) of a free pixel.

    Returns:
        (H, W) in pixels, infinite on obstacles and where no 4-connected path leads.

    Example:
        >>> distance_field(np.ones((5, 5), dtype=bool), (0, 0))[0].tolist()
        [0.0, 1.0, 2.0, 3.0, 4.0]
    """
    column, row = source
    padded = np.full((free.shape[0] + 2, free.shape[1] + 2), np.inf, np.float32)
    clearance = cv2.distanceTransform(
        np.pad(free, 1).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
    )
    radius = min(_EXACT_RADIUS, float(clearance[row + 1, column + 1]) - 1)
    rows, columns = np.ogrid[-1 : free.shape[0] + 1, -1 : free.shape[1] + 1]
    exact = np.hypot(rows - row, columns - column)
    near = exact <= max(0.0, radius)
    padded[near] = exact[near]
    _sweep(np.pad(free, 1), padded, near)
    return padded[1:-1, 1:-1]


@compiled
def _sweep(
    free: NDArray[np.bool_], values: NDArray[np.float32], fixed: NDArray[np.bool_]
) -> None:  # pragma: no cover
    """Sweep in the four diagonal directions, each value at once in place, until none changes."""
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
                    # The solution of (d - a)^2 + (d - b)^2 = 1, or of d - a = 1 if b is too large.
                    two_sided = (a + b + np.sqrt(max(0.0, 2 - (a - b) * (a - b)))) / 2
                    best = two_sided if b - a < 1 else a + 1
                    if best < values[y, x] - _TOLERANCE:
                        values[y, x] = best
                        changed = True
