"""Canvases and shapes that map generators share, and the filling of unreachable pockets."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin

import cv2
import numpy as np
from numpy.typing import NDArray

from ..errors import ConfigError

#: Pixels of a map, (H, W).
Mask = NDArray[np.bool_]
#: A point, or a pair of lengths, (x, y) in pixels.
Point = tuple[float, float]

#: Least width and height of a generated map in pixels; smaller ones have no room for doors.
MIN_SIZE = 48
#: Thickness in pixels of walls that do not grow with the map.
WALL = 3


def check_size(width: int, height: int) -> None:
    """Raise if a map would be too small.

    Raises:
        ConfigError: width or height is below :data:`MIN_SIZE`.
    """
    if min(width, height) < MIN_SIZE:
        raise ConfigError(
            f"maps are generated from {MIN_SIZE} pixels a side up, got {width} x {height}"
        )


def canvas(width: int, height: int) -> tuple[Mask, float]:
    """Return a free map, and the unit of length: 1/64 of the shorter side, in pixels.

    Raises:
        ConfigError: width or height is below :data:`MIN_SIZE`.
    """
    check_size(width, height)
    return np.ones((height, width), dtype=np.bool_), min(width, height) / 64


def empty_map(width: int, height: int) -> Mask:
    """Return a free map.

    Raises:
        ConfigError: width or height is below :data:`MIN_SIZE`.
    """
    return canvas(width, height)[0]


def add_frame(free: Mask, wall: int) -> None:
    """Block a frame of ``wall`` pixels along the border of the map."""
    free[:wall] = free[-wall:] = False
    free[:, :wall] = free[:, -wall:] = False


def scatter(
    free: Mask,
    rng: np.random.Generator,
    fraction: float,
    shape: Callable[[Point], Mask],
    clear: Mask | None = None,
) -> None:
    """Block shapes around random points until a fraction of the map is blocked.

    Args:
        free: the map, changed in place.
        rng: source of all random numbers.
        fraction: of the map that is blocked in the end.
        shape: returns the pixels of a shape around a point.
        clear: pixels that stay free: a shape that touches them is left out.
    """
    height, width = free.shape
    while (~free).mean() < fraction:
        obstacle = shape((rng.uniform(0, width), rng.uniform(0, height)))
        if clear is None or not (obstacle & clear).any():
            free &= ~obstacle


def scatter_clutter(
    free: Mask, rng: np.random.Generator, unit: float, fraction: float, clear: Mask | None = None
) -> None:
    """Scatter boxes and ellipses a few units large; other arguments as for :func:`scatter`."""

    def shape(centre: Point) -> Mask:
        long = rng.uniform(1.2, 4.2) * unit
        kind = box if rng.random() < 0.6 else ellipse
        return kind(free, centre, (long, long * rng.uniform(0.4, 1.0)), rng.uniform(0, pi))

    scatter(free, rng, fraction, shape, clear)


def box(free: Mask, centre: Point, half: Point, angle: float = 0.0) -> Mask:
    """Return the pixels of a box with half sides ``half``, rotated by ``angle`` radians."""
    x, y = _rotate_pixels(free, centre, angle)
    return (abs(x) <= half[0]) & (abs(y) <= half[1])


def ellipse(
    free: Mask, centre: Point, half: Point, angle: float = 0.0, exponent: float = 2.0
) -> Mask:
    """Return the pixels of an ellipse, half axes ``half``; exponents above 2 make it squarer."""
    x, y = _rotate_pixels(free, centre, angle)
    return abs(x / half[0]) ** exponent + abs(y / half[1]) ** exponent <= 1


def triangle(free: Mask, centre: Point, size: float, angle: float) -> Mask:
    """Return the pixels of an equilateral triangle, ``size`` from its centre to its corners."""
    inside = np.ones_like(free)
    for side in range(3):
        x, _ = _rotate_pixels(free, centre, angle + 2 * pi * side / 3)
        inside &= x <= size / 2
    return inside


def _rotate_pixels(
    free: Mask, centre: Point, angle: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the coordinates of all pixel centres in a frame at ``centre``, rotated by ``angle``.

    Returns:
        x and y of each pixel, (H, W) both.
    """
    rows, columns = np.ogrid[: free.shape[0], : free.shape[1]]
    x, y = columns + 0.5 - centre[0], rows + 0.5 - centre[1]
    return cos(angle) * x + sin(angle) * y, cos(angle) * y - sin(angle) * x


def fill_pockets(free: Mask) -> Mask:
    """Return the map with all free parts blocked but the largest 4-connected one.

    Example:
        >>> fill_pockets(np.array([[True, True, False, True]])).tolist()
        [[True, True, False, False]]
    """
    count, labels = cv2.connectedComponents(free.astype(np.uint8), connectivity=4)
    if count <= 2:
        return free
    sizes = np.bincount(labels.ravel())[1:]
    return np.asarray(labels == 1 + int(sizes.argmax()))


def inflate(free: Mask, radius: float) -> Mask:
    """Return the map with obstacles inflated by a radius, and without the pockets that this makes.

    Args:
        free: the map.
        radius: in pixels, at least 1.

    Example:
        >>> inflate(np.array([[True, True, True, False]]), 1).tolist()
        [[True, True, False, False]]
    """
    distance = cv2.distanceTransform(free.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return fill_pockets(distance > radius)


def sample_scale(rng: np.random.Generator, least: float, most: float) -> int:
    """Sample a length in whole pixels, log-uniform between two bounds."""
    return round(float(np.exp(rng.uniform(np.log(least), np.log(max(least, most))))))
