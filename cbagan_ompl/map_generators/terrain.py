"""Families of grown ground: caves, curved walls, cities, race tracks, single blocked cells."""

from __future__ import annotations

from math import pi

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from .shapes import Mask, box, check_sides, empty_map, scale_of, without_pockets


def caves(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Caves: smooth noise, free where it is high."""
    check_sides(width, height)
    noise = _noise(rng, width, height, scale_of(rng, 2, min(width, height) / 12))
    return without_pockets(noise > np.quantile(noise, rng.uniform(0.2, 0.55)))


def curved_walls(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Thin walls along the level lines of smooth noise, with gaps."""
    check_sides(width, height)
    scale = scale_of(rng, 5, min(width, height) / 8)
    noise = _noise(rng, width, height, scale)
    slope = np.hypot(*np.gradient(noise)) + 1e-9
    wall = np.abs(noise) < rng.uniform(0.6, 2.0) * slope
    gaps = _noise(rng, width, height, scale)
    return without_pockets(~wall | (gaps > np.quantile(gaps, rng.uniform(0.6, 0.9))))


def city(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Streets between blocks of houses; houses with yards, gaps between them, squares, avenues."""
    free = empty_map(width, height)
    typical = scale_of(rng, 8, min(width, height) / 4)
    street = int(rng.integers(2, 11))
    parts = rng.uniform(0, 1)
    for top, bottom in _lots(rng, height, typical, street):
        for left, right in _lots(rng, width, typical, street):
            if rng.random() < 0.08:
                continue
            free[top:bottom, left:right] = False
            _open_lot(free[top:bottom, left:right], rng, parts)
    for _ in range(rng.integers(0, 3)):
        middle = rng.uniform(0.2, 0.8) * width, rng.uniform(0.2, 0.8) * height
        free |= box(free, middle, (2.0 * width, rng.uniform(0.5, 1) * street), rng.uniform(0, pi))
    return without_pockets(free)


def race_track(rng: np.random.Generator, width: int, height: int) -> Mask:
    """A closed course with bends in solid ground, now and then with a shortcut."""
    check_sides(width, height)
    count = int(rng.integers(6, 13))
    angles = np.sort(rng.uniform(0, 2 * pi, count))
    radius = rng.uniform(0.35, 0.95, count)
    corners = radius[:, None] * np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    course = _smoothed(corners, 400) * (0.47 * width, 0.47 * height) + (width / 2, height / 2)
    thick = scale_of(rng, 4, min(width, height) / 8)
    ways = [course]
    if rng.random() < 0.3:
        ways.append(course[rng.integers(len(course), size=2)])
    drawn = np.zeros((height, width), np.uint8)
    for way in ways:
        cv2.polylines(drawn, [np.rint(way).astype(np.int32)], way is course, 1, thick)
    return without_pockets(drawn > 0)


def blocked_cells(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Square cells, each blocked with the same probability."""
    check_sides(width, height)
    side = scale_of(rng, 1, min(width, height) / 32)
    shape = -(-height // side), -(-width // side)
    cells = rng.random(shape) >= rng.uniform(0.05, 0.35)
    return without_pockets(cells.repeat(side, axis=0).repeat(side, axis=1)[:height, :width])


def _noise(rng: np.random.Generator, width: int, height: int, scale: float) -> NDArray[np.float64]:
    """Smooth noise without a border, structures about ``scale`` pixels wide."""
    noise: NDArray[np.float64] = gaussian_filter(
        rng.standard_normal((height, width)), scale, mode="reflect"
    )
    return noise


def _smoothed(corners: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """A closed curve of ``count`` points through some corners, rounded; (K, 2) -> (count, 2)."""
    along = np.linspace(0, len(corners), count, endpoint=False)
    closed = np.vstack((corners, corners[:1]))
    curve = np.stack([np.interp(along, np.arange(len(closed)), axis) for axis in closed.T], axis=-1)
    smooth: NDArray[np.float64] = gaussian_filter(
        curve, (0.3 * count / len(corners), 0), mode="wrap"
    )
    return smooth


def _lots(rng: np.random.Generator, side: int, typical: int, street: int) -> list[tuple[int, int]]:
    """First and last pixel of each block along a side, streets between them."""
    lots, place = [], int(rng.integers(0, street + 1))
    while place < side:
        length = max(2, round(typical * rng.uniform(0.5, 1.6)))
        lots.append((place, min(side, place + length)))
        place += length + max(2, round(street * rng.uniform(0.6, 1.6)))
    return lots


def _open_lot(lot: Mask, rng: np.random.Generator, parts: float) -> None:
    """Take a yard, or gaps between houses, out of a block."""
    height, width = lot.shape
    kind = rng.random()
    if kind < 0.25 * parts and min(height, width) > 8:
        inset = int(rng.integers(2, min(height, width) // 3))
        lot[inset:-inset, inset:-inset] = True
        gap = int(rng.integers(inset, width - inset))
        lot[: height // 2, gap : gap + 2] = True
    elif kind < parts:
        for _ in range(rng.integers(1, 4)):
            if rng.random() < 0.5:
                y = int(rng.integers(height))
                lot[y : y + int(rng.integers(2, 5))] = True
            else:
                x = int(rng.integers(width))
                lot[:, x : x + int(rng.integers(2, 5))] = True
