"""Maps as the world has them: any family, at any scale, angle and aspect, worn and measured."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from . import MAP_GENERATORS
from .shapes import MIN_SIDE, Mask, frame, without_pockets

# How often each change is made.
_COARSE, _NARROW, _TURNED, _FRAMED, _RAGGED, _SPECKLED = 0.5, 0.4, 0.4, 0.4, 0.2, 0.2

# Least share of the map that is free; maps with less are drawn again.
_LEAST_FREE = 0.12


def randomized_map(rng: np.random.Generator, side: int, families: Sequence[str]) -> Mask:
    """A square map of a random family, changed at random.

    It may be drawn with fewer pixels and enlarged, so that its edges are steps; be narrower than
    high, or the other way about, and turned by any angle, with what is outside unknown (blocked)
    or open ground; have a wall around it, ragged edges, and specks.

    Args:
        rng: draws all.
        side: of the map in pixels.
        families: names to choose from.
    """
    while True:
        name = families[int(rng.integers(len(families)))]
        free = without_pockets(_placed(rng, _worn(rng, _drawn(rng, name, side)), side))
        if free.mean() >= _LEAST_FREE:
            return free


def _drawn(rng: np.random.Generator, family: str, side: int) -> Mask:
    """A map of the family with a longer side of at most ``side`` pixels, enlarged to it."""
    # The smallest map has no coarser one.
    most = max(side, MIN_SIDE + 1)
    long = int(rng.integers(MIN_SIDE, most)) if rng.random() < _COARSE else side
    short = (
        int(rng.integers(max(MIN_SIDE, long // 2), long + 1)) if rng.random() < _NARROW else long
    )
    width, height = (long, short) if rng.random() < 0.5 else (short, long)
    free = MAP_GENERATORS[family](rng, width, height)
    if rng.random() < _FRAMED:
        frame(free, int(rng.integers(1, 4)))
    shape = round(side * width / long), round(side * height / long)
    return cv2.resize(free.astype(np.uint8), shape, interpolation=cv2.INTER_NEAREST) > 0


def _worn(rng: np.random.Generator, free: Mask) -> Mask:
    """Ragged edges, and specks as a laser scanner leaves them."""
    if rng.random() < _RAGGED:
        blurred = gaussian_filter(free.astype(np.float32), rng.uniform(0.6, 1.5))
        free = blurred + rng.uniform(0.05, 0.25) * rng.standard_normal(free.shape) > 0.5
    if rng.random() < _SPECKLED:
        specks = rng.random(free.shape) < rng.uniform(0.0005, 0.006)
        size = int(rng.integers(1, 4))
        free = free & ~cv2.dilate(specks.astype(np.uint8), np.ones((size, size))).astype(bool)
    return free


def _placed(rng: np.random.Generator, free: Mask, side: int) -> Mask:
    """A square with the map in it, upright, or turned and scaled.

    Outside of an upright map all is blocked; outside of a turned one it is open ground at times.
    """
    height, width = free.shape
    outside = int(rng.random() < 0.3)
    if rng.random() >= _TURNED:
        square = np.zeros((side, side), np.bool_)
        top, left = (int(rng.integers(0, side - n + 1)) for n in (height, width))
        square[top : top + height, left : left + width] = free
        return square
    angle, zoom = rng.uniform(0, 360), rng.uniform(0.75, 1.15)
    matrix = cv2.getRotationMatrix2D((width / 2, height / 2), angle, zoom)
    matrix[:, 2] += (side - width) / 2, (side - height) / 2
    turned = cv2.warpAffine(
        free.astype(np.float32),
        matrix,
        (side, side),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=outside,
    )
    # A wall of one pixel that lies askew is spread over two: half of it still is a wall.
    return turned > 0.6
