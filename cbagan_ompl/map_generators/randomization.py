"""Maps of any generator at any scale, angle and aspect, with ragged edges and specks."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from . import MAP_GENERATORS
from .shapes import MIN_SIZE, Mask, add_frame, fill_pockets

# Probability of each change.
_COARSE, _NARROW, _ROTATED, _FRAMED, _RAGGED, _SPECKLED = 0.5, 0.4, 0.4, 0.4, 0.2, 0.2

# Least fraction of the map that is free; maps with less are generated again.
_LEAST_FREE = 0.12


def randomized_map(rng: np.random.Generator, size: int, generators: Sequence[str]) -> Mask:
    """Generate a square map with a random generator, and change it at random.

    The map may be generated with fewer pixels and enlarged, so that its edges have steps; be
    narrower than high, or lower than wide; be rotated by any angle, with blocked or free pixels
    around it; get a wall around it, ragged edges, and specks as those of a laser scanner.

    Args:
        rng: source of all random numbers.
        size: of the map in pixels.
        generators: keys of :data:`cbagan_ompl.map_generators.MAP_GENERATORS`, all equally likely.

    Returns:
        (size, size), true where free; the free pixels are 4-connected.

    Example:
        >>> randomized_map(np.random.default_rng(0), 64, ["maze"]).shape
        (64, 64)
    """
    while True:
        name = generators[int(rng.integers(len(generators)))]
        scaled = _generate_scaled(rng, name, size)
        free = fill_pockets(_place_in_square(rng, _degrade(rng, scaled), size))
        if free.mean() >= _LEAST_FREE:
            return free


def _generate_scaled(rng: np.random.Generator, generator: str, size: int) -> Mask:
    """Generate a map of at most ``size`` pixels, and enlarge it until its longer side has them."""
    # The smallest map has no coarser one.
    most = max(size, MIN_SIZE + 1)
    long = int(rng.integers(MIN_SIZE, most)) if rng.random() < _COARSE else size
    short = (
        int(rng.integers(max(MIN_SIZE, long // 2), long + 1)) if rng.random() < _NARROW else long
    )
    width, height = (long, short) if rng.random() < 0.5 else (short, long)
    free = MAP_GENERATORS[generator](rng, width, height)
    if rng.random() < _FRAMED:
        add_frame(free, int(rng.integers(1, 4)))
    shape = round(size * width / long), round(size * height / long)
    return cv2.resize(free.astype(np.uint8), shape, interpolation=cv2.INTER_NEAREST) > 0


def _degrade(rng: np.random.Generator, free: Mask) -> Mask:
    """Make edges ragged and add specks, each with some probability."""
    if rng.random() < _RAGGED:
        blurred = gaussian_filter(free.astype(np.float32), rng.uniform(0.6, 1.5))
        free = blurred + rng.uniform(0.05, 0.25) * rng.standard_normal(free.shape) > 0.5
    if rng.random() < _SPECKLED:
        specks = rng.random(free.shape) < rng.uniform(0.0005, 0.006)
        size = int(rng.integers(1, 4))
        free = free & ~cv2.dilate(specks.astype(np.uint8), np.ones((size, size))).astype(bool)
    return free


def _place_in_square(rng: np.random.Generator, free: Mask, size: int) -> Mask:
    """Put a map into a square, as it is, or rotated and scaled.

    The pixels around an unrotated map are blocked; those around a rotated one may be free.
    """
    height, width = free.shape
    outside = int(rng.random() < 0.3)
    if rng.random() >= _ROTATED:
        square = np.zeros((size, size), np.bool_)
        top, left = (int(rng.integers(0, size - n + 1)) for n in (height, width))
        square[top : top + height, left : left + width] = free
        return square
    angle, zoom = rng.uniform(0, 360), rng.uniform(0.75, 1.15)
    matrix = cv2.getRotationMatrix2D((width / 2, height / 2), angle, zoom)
    matrix[:, 2] += (size - width) / 2, (size - height) / 2
    rotated = cv2.warpAffine(
        free.astype(np.float32),
        matrix,
        (size, size),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=outside,
    )
    # A wall of one pixel is spread over two when it is rotated: half of it still is a wall.
    return rotated > 0.6
