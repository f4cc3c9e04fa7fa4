"""Convex parts of a polygon: the checks know convex regions only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import RobotError
from .polygons import is_convex, signed_area

Points = NDArray[np.float64]


def convex_parts(vertices: Points) -> list[Points]:
    """Return convex polygons that together are a simple polygon.

    The polygon is cut into triangles by ear clipping, see G. H. Meisters, "Polygons have ears",
    American Mathematical Monthly 82 (1975); then triangles are joined across the cuts as long as
    what comes out is convex (Hertel and Mehlhorn, "Fast triangulation of simple polygons", 1983).

    Args:
        vertices: (N, 2), counter-clockwise, as from
            :func:`cbagan_ompl.robots.polygons.check_polygon`.

    Raises:
        RobotError: the corners are too close to each other to be told apart.

    Example:
        >>> arrow = np.array([(0, 0), (4, -2), (1, 0), (4, 2)], dtype=float)
        >>> len(convex_parts(arrow))
        2
    """
    if is_convex(vertices):
        return [vertices]
    parts = [list(triangle) for triangle in _clip_ears(vertices)]
    joined = True
    while joined:
        joined = False
        for first in range(len(parts)):
            for second in range(first + 1, len(parts)):
                union = _join(parts[first], parts[second])
                if union is not None and is_convex(vertices[union]):
                    parts[first] = union
                    del parts[second]
                    joined = True
                    break
            if joined:
                break
    return [vertices[part] for part in parts]


def _clip_ears(vertices: Points) -> list[tuple[int, int, int]]:
    left = list(range(len(vertices)))
    triangles = []
    while len(left) > 3:
        for position, corner in enumerate(left):
            before, after = left[position - 1], left[(position + 1) % len(left)]
            triangle = vertices[[before, corner, after]]
            others = [index for index in left if index not in (before, corner, after)]
            if signed_area(triangle) > 0 and not _holds_any(triangle, vertices[others]):
                triangles.append((before, corner, after))
                del left[position]
                break
        else:
            raise RobotError(
                "the corners of the polygon are too close to each other to be told apart; "
                "simplify it"
            )
    return [*triangles, (left[0], left[1], left[2])]


def _holds_any(triangle: Points, points: Points) -> bool:
    inside = np.ones(len(points), dtype=np.bool_)
    for corner in range(3):
        start, end = triangle[corner], triangle[(corner + 1) % 3]
        edge, offset = end - start, points - start
        inside &= edge[0] * offset[:, 1] - edge[1] * offset[:, 0] >= 0
    return bool(inside.any())


def _join(first: list[int], second: list[int]) -> list[int] | None:
    """Return the union of two polygons that share an edge, as indices of vertices, or None."""
    for i in range(len(first)):
        a, b = first[i], first[(i + 1) % len(first)]
        for j in range(len(second)):
            if second[j] == b and second[(j + 1) % len(second)] == a:
                around = second[j + 1 :] + second[: j + 1]
                return first[: i + 1] + around[1:-1] + first[i + 1 :]
    return None
