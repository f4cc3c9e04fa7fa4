"""Sampling of pixels, and of points inside them."""

from __future__ import annotations

from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from ..maps.grid_map import GridMap

#: Two pixels (column, row).
PixelPair = tuple[tuple[int, int], tuple[int, int]]

# Pixels whose weights are summed up together, and samples that are looked up in blocks at a time.
_BLOCK, _LOOKED_UP = 16, 4096


class WeightedPixels:
    """Pixels that are sampled by their weights, exactly: by the inverse of the cumulative sum.

    Only the sums of blocks of pixels are made beforehand; the sum inside a block is made for each
    sample that falls into it. For millions of pixels that is ten times sooner than the whole sum.

    Args:
        pixels: flat row-major indices, (K,).
        weights: of the pixels, (K,), at least 0 and not all 0; None where all weigh the same.

    Example:
        >>> pixels = WeightedPixels(np.array([3, 5, 8]), np.array([1, 0, 1], np.float32))
        >>> sorted(set(pixels.sample(100, np.random.default_rng(0)).tolist()))
        [3, 8]
    """

    def __init__(self, pixels: NDArray[np.intp], weights: NDArray[np.float32] | None) -> None:
        self._pixels = pixels
        self._blocks: NDArray[np.float32] | None = None
        if weights is not None:
            whole = len(pixels) // _BLOCK * _BLOCK
            self._blocks = np.ascontiguousarray(weights[:whole]).reshape(-1, _BLOCK)
            # Kept apart, since it may be cut off: all others need no copy then.
            self._last = np.zeros(_BLOCK, np.float32)
            self._last[: len(pixels) - whole] = weights[whole:]
            # With a 0 before: what is below each block, and all.
            self._below = np.zeros(len(self._blocks) + 2)
            sums = self._below[1:]
            if whole:  # NumPy takes seven times as long for the sums of short rows
                sums[:-1] = cv2.reduce(self._blocks, 1, cv2.REDUCE_SUM, dtype=cv2.CV_64F)[:, 0]
            sums[-1] = self._last.sum(dtype=np.float64)
            np.cumsum(sums, out=sums)

    def sample(self, n: int, rng: np.random.Generator) -> NDArray[np.intp]:
        """Return flat row-major indices of pixels, (n,).

        Args:
            n: how many.
            rng: the generator.
        """
        if self._blocks is None:
            return self._pixels[rng.integers(len(self._pixels), size=n)]
        targets = rng.random(n) * self._below[-1]
        chosen = np.empty(n, np.intp)
        for begin in range(0, n, _LOOKED_UP):
            part = slice(begin, begin + _LOOKED_UP)
            chosen[part] = self._find(self._blocks, targets[part])
        return self._pixels[chosen]

    def _find(self, blocks: NDArray[np.float32], targets: NDArray[np.float64]) -> NDArray[np.intp]:
        """Return the place of the pixel at which the sum of the weights passes each target."""
        block = np.searchsorted(self._below[1:], targets, side="right").clip(max=len(blocks))
        is_whole = block < len(blocks)
        weights = np.tile(self._last, (len(targets), 1))
        weights[is_whole] = blocks[block[is_whole]]
        # Sums of all samples side by side: along short rows NumPy takes twice as long.
        sums = weights.T.astype(np.float64, order="C")
        for before, here in pairwise(sums):
            here += before
        passed = (sums <= targets - self._below[block]).sum(axis=0)
        places = block * _BLOCK + passed.clip(max=_BLOCK - 1)
        return np.asarray(places.clip(max=len(self._pixels) - 1))


def sample_in_pixels(
    grid: GridMap, pixels: NDArray[np.intp], rng: np.random.Generator
) -> NDArray[np.float64]:
    """Sample a uniform point in each of some pixels.

    Args:
        grid: the map.
        pixels: flat row-major indices, shape (n,).
        rng: the generator.

    Returns:
        World points, shape (n, 2).
    """
    corners = np.stack((pixels % grid.width, pixels // grid.width), axis=-1)
    return grid.to_world(corners + rng.random((len(pixels), 2)))


def pixel_pair(endpoints: NDArray[np.float64]) -> PixelPair:
    """Return the pixels (column, row) of two points (u, v), shape (2, 2)."""
    (u0, v0), (u1, v1) = np.floor(endpoints).astype(int).tolist()
    return (u0, v0), (u1, v1)
