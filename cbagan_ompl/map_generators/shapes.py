"""What map families draw with: canvases, shapes, and the end of pockets that nothing reaches."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin

import cv2
import numpy as np
from numpy.typing import NDArray

from ..errors import ConfigError

Mask = NDArray[np.bool_]
Point = tuple[float, float]

#: Shorter sides than this have no room for walls and doors.
MIN_SIDE = 48
#: Thickness of walls that do not grow with the map.
WALL = 3


def check_sides(width: int, height: int) -> None:
    """Refuse maps that are too small.

    Raises:
        ConfigError: a side is shorter than :data:`MIN_SIDE`.
    """
    if min(width, height) < MIN_SIDE:
        raise ConfigError(
            f"maps are drawn from {MIN_SIDE} pixels a side up, got {width} x {height}"
        )


def canvas(width: int, height: int) -> tuple[Mask, float]:
    """A free map and the unit of length, 4 pixels where the shorter side is 256.

    Raises:
        ConfigError: a side is shorter than :data:`MIN_SIDE`.
    """
    check_sides(width, height)
    return np.ones((height, width), dtype=np.bool_), min(width, height) / 64


def frame(free: Mask, wall: int) -> None:
    """Draw a wall around the map."""
    free[:wall] = free[-wall:] = False
    free[:, :wall] = free[:, -wall:] = False


def scatter(
    free: Mask, rng: np.random.Generator, unit: float, share: float, clear: Mask | None = None
) -> None:
    """Draw boxes and ellipses, none that touches ``clear``, until a share of the map is blocked."""

    def draw(centre: Point) -> Mask:
        long = rng.uniform(1.2, 4.2) * unit
        shape = box if rng.random() < 0.6 else ellipse
        return shape(free, centre, (long, long * rng.uniform(0.4, 1.0)), rng.uniform(0, pi))

    strew(free, rng, share, draw, clear)


def strewn(
    free: Mask, rng: np.random.Generator, share: float, draw: Callable[[Point], Mask]
) -> Mask:
    """The map with obstacles strewn over it, and without pockets."""
    strew(free, rng, share, draw)
    return without_pockets(free)


def strew(
    free: Mask,
    rng: np.random.Generator,
    share: float,
    draw: Callable[[Point], Mask],
    clear: Mask | None = None,
) -> None:
    """Block what is drawn around random points, nothing that touches ``clear``, up to a share."""
    height, width = free.shape
    while (~free).mean() < share:
        drawn = draw((rng.uniform(0, width), rng.uniform(0, height)))
        if clear is None or not (drawn & clear).any():
            free &= ~drawn


def turned(
    free: Mask, centre: Point, angle: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coordinates of the pixels' middles in a frame at ``centre`` that is turned by ``angle``."""
    rows, columns = np.ogrid[: free.shape[0], : free.shape[1]]
    x, y = columns + 0.5 - centre[0], rows + 0.5 - centre[1]
    return cos(angle) * x + sin(angle) * y, cos(angle) * y - sin(angle) * x


def box(free: Mask, centre: Point, half: Point, angle: float = 0.0) -> Mask:
    """The pixels of a box with half sides ``half``."""
    x, y = turned(free, centre, angle)
    return (abs(x) <= half[0]) & (abs(y) <= half[1])


def ellipse(free: Mask, centre: Point, half: Point, angle: float = 0.0, power: float = 2.0) -> Mask:
    """The pixels of an ellipse with half axes ``half``; a power above 2 makes it squarer."""
    x, y = turned(free, centre, angle)
    return abs(x / half[0]) ** power + abs(y / half[1]) ** power <= 1


def triangle(free: Mask, centre: Point, size: float, angle: float) -> Mask:
    """The pixels of a triangle with equal sides, ``size`` from its middle to its corners."""
    inside = np.ones_like(free)
    for side in range(3):
        x, _ = turned(free, centre, angle + 2 * pi * side / 3)
        inside &= x <= size / 2
    return inside


def without_pockets(free: Mask) -> Mask:
    """Fill all but the largest connected free part."""
    count, labels = cv2.connectedComponents(free.astype(np.uint8), connectivity=4)
    if count <= 2:
        return free
    sizes = np.bincount(labels.ravel())[1:]
    return np.asarray(labels == 1 + int(sizes.argmax()))


def empty_map(width: int, height: int) -> Mask:
    """A free map.

    Raises:
        ConfigError: a side is shorter than :data:`MIN_SIDE`.
    """
    return canvas(width, height)[0]


def scale_of(rng: np.random.Generator, least: float, most: float) -> int:
    """A length in whole pixels between two bounds, small ones as likely as large ones by factor."""
    return round(float(np.exp(rng.uniform(np.log(least), np.log(max(least, most))))))
