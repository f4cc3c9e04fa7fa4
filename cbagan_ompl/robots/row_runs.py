"""Whether a convex region touches a blocked pixel: exact, row by row of the map."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

#: Points (u, v) of a region, in pixel coordinates.
Region = list[tuple[float, float]]


class RowRuns(NamedTuple):
    """How many free pixels follow each other to the right, from each pixel on.

    Attributes:
        lengths: row-major; 0 for a blocked pixel. Outside of the map nothing is free.
        width: columns of the map.
        height: rows of the map.
    """

    lengths: memoryview
    width: int
    height: int


def row_runs(free: NDArray[np.bool_]) -> RowRuns:
    """Return the runs of free pixels of a map, (H, W).

    Example:
        >>> list(row_runs(np.array([[True, True, False, True]])).lengths)
        [2, 1, 0, 1]
    """
    height, width = free.shape
    columns = np.broadcast_to(np.arange(width, dtype=np.int32), free.shape)
    # The column of the next blocked pixel at or to the right of each.
    ends = np.where(free, width, columns)
    ends = np.minimum.accumulate(ends[:, ::-1], axis=1)[:, ::-1]
    lengths = np.ascontiguousarray(ends - columns, dtype=np.uint16)
    return RowRuns(memoryview(lengths.tobytes()).cast("H"), width, height)


def region_is_free(points: Region, margin: float, runs: RowRuns) -> bool:
    """Return whether the convex hull of points touches no blocked pixel and stays in the map.

    Args:
        points: at least one.
        margin: how far the hull is moved outwards along both axes first, in pixels. With any
            margin at all, a region that only touches the edge of a pixel touches the pixel; with
            none, a point on the edge of two pixels belongs to the right or lower one.
        runs: of the map.
    """
    points.sort(key=_by_row)
    top, bottom = points[0][1], points[-1][1]
    if not (top - margin >= 0 and bottom + margin < runs.height):
        return False
    first = int(top - margin)
    count = int(bottom + margin) - first + 1
    lefts, rights = [inf] * count, [-inf] * count
    _trace(_chain(points, -1.0), margin, first, lefts, rights)
    _trace(_chain(points, 1.0), margin, first, lefts, rights)
    lengths, width = runs.lengths, runs.width
    row = first * width
    for left, right in zip(lefts, rights, strict=True):
        left -= margin
        if not (left >= 0 and right + margin < width):
            return False
        column = int(left)
        if lengths[row + column] <= int(right + margin) - column:
            return False
        row += width
    return True


def _by_row(point: tuple[float, float]) -> tuple[float, float]:
    return point[1], point[0]


def _chain(points: Region, side: float) -> Region:
    """Return the left (-1) or right (1) side of the hull of points in the order of their rows.

    A. M. Andrew, "Another efficient algorithm for convex hulls in two dimensions", Information
    Processing Letters 9 (1979), https://doi.org/10.1016/0020-0190(79)90072-3.
    """
    chain: Region = []
    for u, v in points:
        while len(chain) > 1:
            (u0, v0), (u1, v1) = chain[-2], chain[-1]
            if side * ((u1 - u0) * (v - v0) - (v1 - v0) * (u - u0)) > 0:
                break
            chain.pop()
        chain.append((u, v))
    return chain


def _trace(
    chain: Region, margin: float, first: int, lefts: list[float], rights: list[float]
) -> None:
    """Widen the extent of each row by the part of a chain in it, the margin above and below too."""
    u0, v0 = chain[0]
    for u1, v1 in chain[1:] or chain:
        slope = (u1 - u0) / (v1 - v0) if v1 > v0 else 0.0
        row, last = int(v0 - margin), int(v1 + margin)
        while row <= last:
            upper, lower = row - margin, row + 1 + margin
            a = u0 + (upper - v0) * slope if upper > v0 else u0
            b = u0 + (lower - v0) * slope if lower < v1 else u1
            if a > b:
                a, b = b, a
            index = row - first
            if a < lefts[index]:
                lefts[index] = a
            if b > rights[index]:
                rights[index] = b
            row += 1
        u0, v0 = u1, v1
