"""Sampling of pixels, and of points inside them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..maps.grid_map import GridMap


def sample_pixels(
    support: NDArray[np.intp],
    cumulative: NDArray[np.float64] | None,
    n: int,
    rng: np.random.Generator,
) -> NDArray[np.intp]:
    """Sample some of the pixels of a heat map.

    Args:
        support: flat row-major pixel indices, shape (K,).
        cumulative: cumulative sum of their weights, shape (K,), the last one above 0; None where
            all weigh the same.
        n: how many.
        rng: the generator.

    Returns:
        Flat row-major pixel indices, shape (n,).
    """
    if cumulative is None:
        chosen = rng.integers(len(support), size=n)
    else:
        chosen = np.searchsorted(cumulative, rng.random(n) * cumulative[-1], side="right")
    pixels: NDArray[np.intp] = support[np.minimum(chosen, len(support) - 1)]
    return pixels


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


def pixel_pair(endpoints: NDArray[np.float64]) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the pixels (column, row) of two points (u, v), shape (2, 2)."""
    (u0, v0), (u1, v1) = np.floor(endpoints).astype(int).tolist()
    return (u0, v0), (u1, v1)
