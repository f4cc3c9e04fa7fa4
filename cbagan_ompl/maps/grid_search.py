"""Shortest paths over the free pixels of a grid, for the corridor and for repairing heat maps."""

from __future__ import annotations

from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

# Coarse pixels to each side of the coarse path that make the band to search in.
_BAND = 3


def prepare_search(with_costs: bool = False) -> None:
    """Load what paths are searched with, and compile it where that is not done yet.

    That takes half a second, and once on each machine some ten seconds, which the first search
    would take otherwise.

    Args:
        with_costs: also what searches with a cost for each pixel.
    """
    free = np.ones((3, 3), np.bool_)
    path = shortest_path(free, (0, 0), (2, 2))
    assert path is not None
    pull_taut(free, path)
    if with_costs:
        shortest_path(free, (0, 0), (2, 2), np.ones((3, 3), np.float32))


def shortest_path(
    free: NDArray[np.bool_],
    start: tuple[int, int],
    goal: tuple[int, int],
    cost: NDArray[np.float32] | None = None,
    coarse_size: int = 256,
) -> NDArray[np.intp] | None:
    """Return the cheapest 8-connected path between two pixels.

    A diagonal step needs both pixels beside it free, so that the path is a valid motion. Large
    grids with costs are searched around the path through a coarse grid first, so that their path
    may be a little costlier than the cheapest; without costs the search needs no such help.

    Args:
        free: shape (H, W).
        start: (column, row) of a free pixel.
        goal: (column, row) of a free pixel.
        cost: cost of a pixel length in each pixel, shape (H, W), positive; 1 by default. A step
            costs its length times the mean cost of its two pixels.
        coarse_size: longest side of the coarse grid, in pixels; grids up to twice as long need
            none.

    Returns:
        Pixels (column, row), shape (K, 2), both endpoints included; None where no path connects
        them.
    """
    from .compiled_search import find_path  # here, since numba takes long to import

    if cost is not None and max(free.shape) > 2 * coarse_size:
        band = _coarse_band(free, start, goal, cost, coarse_size)
        path = None if band is None else find_path(free & band, start, goal, cost)
        if path is not None:
            return path
    return find_path(free, start, goal, cost)


def _coarse_band(
    free: NDArray[np.bool_],
    start: tuple[int, int],
    goal: tuple[int, int],
    cost: NDArray[np.float32],
    coarse_size: int,
) -> NDArray[np.bool_] | None:
    """Return the pixels near the cheapest path through blocks of pixels.

    A block is free where any of its pixels is.
    """
    from .compiled_search import find_path

    size = -(-max(free.shape) // coarse_size)
    padding = [(0, -side % size) for side in free.shape]
    blocks = np.pad(free, padding)
    shape = blocks.shape[0] // size, size, blocks.shape[1] // size, size
    coarse = np.asarray(blocks.reshape(shape).any(axis=(1, 3)))
    coarse_cost = np.pad(cost, padding, mode="edge").reshape(shape).mean(axis=(1, 3))
    source, target = ((u // size, v // size) for u, v in (start, goal))
    path = find_path(coarse, source, target, coarse_cost)
    if path is None:
        return None
    visited = np.zeros(coarse.shape, np.uint8)
    visited[path[:, 1], path[:, 0]] = 1
    band = cv2.dilate(visited, np.ones((2 * _BAND + 1, 2 * _BAND + 1), np.uint8))
    fine = band.repeat(size, axis=0).repeat(size, axis=1)[: free.shape[0], : free.shape[1]]
    return fine.astype(bool)


def pull_taut(free: NDArray[np.bool_], pixels: NDArray[np.intp]) -> NDArray[np.float64]:
    """Shorten a pixel path to straight segments that stay in free pixels.

    Args:
        free: shape (H, W).
        pixels: a path as returned by :func:`shortest_path`, shape (K, 2).

    Returns:
        Corner points of the shortened path at pixel centres, (u, v), shape (M, 2), M <= K.
    """
    from .compiled_search import segment_is_free_compiled

    height, width = free.shape
    cells = free.ravel()
    points = (pixels + 0.5).tolist()
    corners = [points[0]]
    for here, ahead in pairwise(points[1:]):
        if not segment_is_free_compiled(cells, width, height, *corners[-1], *ahead):
            corners.append(here)
    corners.append(points[-1])
    return np.array(corners, dtype=np.float64)
