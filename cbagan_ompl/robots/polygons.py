"""Simple polygons: what makes one valid, and its measures."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import RobotError, show

#: Most vertices of a polygon; checks take time with each of them.
MAX_VERTICES = 1000

# Vertices nearer than this are one, and an area below its square is none: as a fraction of the
# polygon's extent.
_ROUNDING = 1e-9

Points = NDArray[np.float64]


def check_polygon(vertices: ArrayLike) -> Points:
    """Return the vertices of a simple polygon, counter-clockwise (from x to y).

    Vertices that repeat the one before, and a last one that repeats the first, are left out.

    Args:
        vertices: (N, 2), in order along the outline, either way round.

    Returns:
        (M, 2) with M at least 3.

    Raises:
        RobotError: not such an array, not finite, fewer than three vertices or more than
            :data:`MAX_VERTICES`, no area, or an outline that crosses or touches itself.
    """
    points = _drop_repeated(_as_vertices(vertices))
    if len(points) < 3:
        raise RobotError(
            f"a polygon has at least three different vertices, this one {len(points)}; for a robot "
            "without size use Robot.point()"
        )
    area = signed_area(points)
    extent = float(np.ptp(points, axis=0).max())
    if abs(area) <= _ROUNDING * extent**2:
        raise RobotError(
            f"the polygon {show(points.tolist())} has no area: its vertices are on a line"
        )
    crossing = _find_crossing(points)
    if crossing is not None:
        first, second = crossing
        raise RobotError(
            f"the polygon crosses or touches itself: the edge from vertex {first} meets the edge "
            f"from vertex {second}; list the vertices in order along the outline"
        )
    return points if area > 0 else np.ascontiguousarray(points[::-1])


def signed_area(points: Points) -> float:
    """Return the area inside an outline, (N, 2): positive where it turns from x to y.

    Example:
        >>> signed_area(np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)]))
        2.0
    """
    x, y = (points - points[0]).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)


def is_convex(points: Points) -> bool:
    """Return whether a simple polygon, counter-clockwise, has no corner that turns inwards."""
    edges = np.roll(points, -1, axis=0) - points
    following = np.roll(edges, -1, axis=0)
    turns = _cross(edges, following)
    lengths = np.hypot(*edges.T) * np.hypot(*following.T)
    return bool((turns >= -_ROUNDING * lengths).all())


def contains_origin(points: Points) -> bool:
    """Return whether (0, 0) lies inside a simple polygon, by the even-odd rule."""
    x, y = points.T
    next_x, next_y = np.roll(x, -1), np.roll(y, -1)
    crosses = (y > 0) != (next_y > 0)
    rise = np.where(crosses, next_y - y, 1.0)
    return bool(np.count_nonzero(crosses & (x - y * (next_x - x) / rise > 0)) % 2)


def distance_to_outline(points: Points) -> float:
    """Return the distance from (0, 0) to the outline of a polygon."""
    edges = np.roll(points, -1, axis=0) - points
    along = np.clip(-np.sum(points * edges, axis=1) / np.sum(edges**2, axis=1), 0.0, 1.0)
    return float(np.hypot(*(points + along[:, None] * edges).T).min())


def _as_vertices(vertices: ArrayLike) -> Points:
    try:
        raw = np.asarray(vertices)
        points = raw.astype(np.float64) if raw.dtype.kind in "iuf" else None
    except Exception as error:  # rows of different lengths, or whatever the class raises
        raise RobotError(f"a polygon is a list of points (x, y), got {show(vertices)}") from error
    if points is None or points.ndim != 2 or points.shape[1] != 2 or len(points) == 0:
        raise RobotError(
            f"a polygon is a list of points (x, y), shape (N, 2), got {show(vertices)}"
        )
    if not np.isfinite(points).all():
        raise RobotError(f"the vertices of a polygon are finite numbers, got {show(vertices)}")
    if len(points) > MAX_VERTICES:
        raise RobotError(
            f"a polygon has at most {MAX_VERTICES} vertices, this one {len(points)}; simplify it"
        )
    if np.abs(points).max() > 1e100:
        raise RobotError(f"a polygon of that size has no meaning: {show(vertices)}")
    return points


def _drop_repeated(points: Points) -> Points:
    least = _ROUNDING * float(np.ptp(points, axis=0).max())
    kept = [points[0]]
    for point in points[1:]:
        if np.hypot(*(point - kept[-1])) > least:
            kept.append(point)
    if len(kept) > 1 and np.hypot(*(kept[-1] - kept[0])) <= least:
        kept.pop()
    return np.array(kept)


def _cross(a: Points, b: Points) -> NDArray[np.float64]:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _find_crossing(points: Points) -> tuple[int, int] | None:
    """Return the first vertices of two edges that meet where they should not, or None."""
    count = len(points)
    ends = np.roll(points, -1, axis=0)
    edges = ends - points
    # Neighbouring edges meet in their corner. They must not fold back onto each other.
    following = np.roll(edges, -1, axis=0)
    folded = (np.abs(_cross(edges, following)) <= 1e-12 * np.hypot(*edges.T) ** 2) & (
        np.sum(edges * following, axis=1) < 0
    )
    if folded.any():
        index = int(np.flatnonzero(folded)[0])
        return index, (index + 1) % count
    for index in range(count):
        others = np.arange(index + 2, count - (index == 0))
        if others.size:
            meets = _meet(points[index], ends[index], points[others], ends[others])
            if meets.any():
                return index, int(others[np.flatnonzero(meets)[0]])
    return None


def _meet(start: Points, end: Points, starts: Points, ends: Points) -> NDArray[np.bool_]:
    """Return which of many segments a segment crosses or touches."""
    a, b = _cross(end - start, starts - start), _cross(end - start, ends - start)
    c, d = _cross(ends - starts, start - starts), _cross(ends - starts, end - starts)
    # On one line: their boxes decide.
    low, high = np.minimum(start, end), np.maximum(start, end)
    boxes = (np.minimum(starts, ends) <= high) & (np.maximum(starts, ends) >= low)
    return np.asarray((a * b <= 0) & (c * d <= 0) & boxes.all(axis=1))
