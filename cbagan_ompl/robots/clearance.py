"""The exact distance from a shape to the nearest blocked pixel."""

from __future__ import annotations

from math import hypot, inf, sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from .pixel_shape import PixelShape, rotate

Points = NDArray[np.float64]


class ShapeClearance:
    """Distances from a shape to the squares of the blocked pixels of a map.

    Args:
        free: (H, W), true where free.
        shape: in pixels.
    """

    def __init__(self, free: NDArray[np.bool_], shape: PixelShape) -> None:
        self._shape = shape
        self._free = free
        mask = free.view(np.uint8)
        #: From centre to centre; None where nothing is blocked.
        self._distances = (
            None if free.all() else cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        )
        # Only the edge of an obstacle is near to anything.
        inner = cv2.erode(1 - mask, np.ones((3, 3), np.uint8), borderValue=1.0)
        self._edges = np.asarray((mask == 0) & (inner == 0))

    def __call__(self, u: float, v: float, heading: float) -> float:
        """Return the distance at a pose that touches nothing, pixels; infinite without obstacles.

        Args:
            u: of the reference point, pixels.
            v: of the reference point, pixels.
            heading: in the frame of the pixels.
        """
        if self._distances is None:
            return inf
        # The obstacle nearest to the reference point is a bound; what is nearer to the shape is
        # within it around the shape.
        within = float(self._distances[int(v), int(u)]) + 1.5
        heading = heading if self._shape.turns else 0.0
        least = inf
        for part in self._shape.parts:
            points = rotate(part, heading) + np.array((u, v))
            squares = self._squares_near(points, within + hypot(*np.abs(part).max(axis=0)))
            if len(squares):
                least = min(least, _distance(points, squares))
        return least

    def _squares_near(self, points: Points, within: float) -> Points:
        """Return the upper left corners of the edge pixels around points, (K, 2)."""
        low = np.maximum(np.floor(points.min(axis=0) - within), 0).astype(int)
        high = np.ceil(points.max(axis=0) + within).astype(int)
        rows, columns = np.nonzero(self._edges[low[1] : high[1], low[0] : high[0]])
        return np.asarray(np.stack((columns, rows), axis=1) + low, np.float64)


def _distance(points: Points, squares: Points) -> float:
    """Return the distance between a convex polygon, (N, 2), and squares that it does not touch.

    Two convex polygons are nearest at a vertex of one of them.
    """
    nearest = np.clip(points[:, None], squares, squares + 1)
    least = float(((points[:, None] - nearest) ** 2).sum(axis=2).min())
    if len(points) > 1:
        corners = (squares[:, None] + ((0, 0), (1, 0), (0, 1), (1, 1))).reshape(-1, 1, 2)
        edges = np.roll(points, -1, axis=0) - points
        along = ((corners - points) * edges).sum(axis=2) / (edges**2).sum(axis=1)
        nearest = points + np.clip(along, 0, 1)[..., None] * edges
        least = min(least, float(((corners - nearest) ** 2).sum(axis=2).min()))
    return sqrt(least)
