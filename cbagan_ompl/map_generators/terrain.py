"""Map generators of terrain: caves, curved walls, cities, race tracks, blocked cells."""

from __future__ import annotations

from math import pi

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from .shapes import Mask, box, check_size, empty_map, fill_pockets, sample_scale


def caves(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate caves: smooth noise, free where it is high.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    check_size(width, height)
    noise = _sample_noise(rng, width, height, sample_scale(rng, 2, min(width, height) / 12))
    return fill_pockets(noise > np.quantile(noise, rng.uniform(0.2, 0.55)))


def curved_walls(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate thin walls along the level lines of smooth noise, with gaps.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    check_size(width, height)
    scale = sample_scale(rng, 5, min(width, height) / 8)
    noise = _sample_noise(rng, width, height, scale)
    slope = np.hypot(*np.gradient(noise)) + 1e-9
    wall = np.abs(noise) < rng.uniform(0.6, 2.0) * slope
    gaps = _sample_noise(rng, width, height, scale)
    return fill_pockets(~wall | (gaps > np.quantile(gaps, rng.uniform(0.6, 0.9))))


def city(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate streets between blocks of houses, with yards, gaps, squares and avenues.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free = empty_map(width, height)
    typical = sample_scale(rng, 8, min(width, height) / 4)
    street = int(rng.integers(2, 11))
    opened = rng.uniform(0, 1)
    for top, bottom in _split_into_blocks(rng, height, typical, street):
        for left, right in _split_into_blocks(rng, width, typical, street):
            if rng.random() < 0.08:
                continue
            free[top:bottom, left:right] = False
            _open_block(free[top:bottom, left:right], rng, opened)
    for _ in range(rng.integers(0, 3)):
        middle = rng.uniform(0.2, 0.8) * width, rng.uniform(0.2, 0.8) * height
        free |= box(free, middle, (2.0 * width, rng.uniform(0.5, 1) * street), rng.uniform(0, pi))
    return fill_pockets(free)


def race_track(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate a closed race track in solid ground, sometimes with a shortcut.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    check_size(width, height)
    count = int(rng.integers(6, 13))
    angles = np.sort(rng.uniform(0, 2 * pi, count))
    radius = rng.uniform(0.35, 0.95, count)
    corners = radius[:, None] * np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    course = _smooth_curve(corners, 400) * (0.47 * width, 0.47 * height) + (width / 2, height / 2)
    track_width = sample_scale(rng, 4, min(width, height) / 8)
    lines = [course]
    if rng.random() < 0.3:
        lines.append(course[rng.integers(len(course), size=2)])
    track = np.zeros((height, width), np.uint8)
    for line in lines:
        cv2.polylines(track, [np.rint(line).astype(np.int32)], line is course, 1, track_width)
    return fill_pockets(track > 0)


def blocked_cells(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate square cells, each blocked with the same probability.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    check_size(width, height)
    cell = sample_scale(rng, 1, min(width, height) / 32)
    shape = -(-height // cell), -(-width // cell)
    cells = rng.random(shape) >= rng.uniform(0.05, 0.35)
    return fill_pockets(cells.repeat(cell, axis=0).repeat(cell, axis=1)[:height, :width])


def _sample_noise(
    rng: np.random.Generator, width: int, height: int, scale: float
) -> NDArray[np.float64]:
    """Sample smooth noise with structures about ``scale`` pixels wide."""
    noise: NDArray[np.float64] = gaussian_filter(
        rng.standard_normal((height, width)), scale, mode="reflect"
    )
    return noise


def _smooth_curve(corners: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return a smooth closed curve of ``count`` points near the corners, (K, 2) -> (count, 2)."""
    along = np.linspace(0, len(corners), count, endpoint=False)
    closed = np.vstack((corners, corners[:1]))
    curve = np.stack([np.interp(along, np.arange(len(closed)), axis) for axis in closed.T], axis=-1)
    smooth: NDArray[np.float64] = gaussian_filter(
        curve, (0.3 * count / len(corners), 0), mode="wrap"
    )
    return smooth


def _split_into_blocks(
    rng: np.random.Generator, length: int, typical: int, street: int
) -> list[tuple[int, int]]:
    """Return the range of pixels of each block along a street, cross streets between them."""
    blocks, first = [], int(rng.integers(0, street + 1))
    while first < length:
        size = max(2, round(typical * rng.uniform(0.5, 1.6)))
        blocks.append((first, min(length, first + size)))
        first += size + max(2, round(street * rng.uniform(0.6, 1.6)))
    return blocks


def _open_block(block: Mask, rng: np.random.Generator, probability: float) -> None:
    """Cut a yard or gaps between houses out of a block, with some probability."""
    height, width = block.shape
    kind = rng.random()
    if kind < 0.25 * probability and min(height, width) > 8:
        inset = int(rng.integers(2, min(height, width) // 3))
        block[inset:-inset, inset:-inset] = True
        gap = int(rng.integers(inset, width - inset))
        block[: height // 2, gap : gap + 2] = True
    elif kind < probability:
        for _ in range(rng.integers(1, 4)):
            if rng.random() < 0.5:
                y = int(rng.integers(height))
                block[y : y + int(rng.integers(2, 5))] = True
            else:
                x = int(rng.integers(width))
                block[:, x : x + int(rng.integers(2, 5))] = True
