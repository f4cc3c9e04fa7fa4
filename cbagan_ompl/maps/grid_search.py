"""Shortest paths over the free pixels of a grid, for the corridor and for repairing heat maps."""

from __future__ import annotations

from itertools import pairwise
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from .blocks import any_in_blocks

# Coarse pixels to each side of the coarse path that make the band to search in.
_BAND = 3


class Costs(Protocol):
    """The cost of a pixel length in each pixel, positive: an array, or what makes its parts."""

    def __getitem__(self, window: tuple[slice, slice], /) -> NDArray[np.float32]:
        """Return the costs in some rows and columns."""


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
    cost: Costs | None = None,
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

    if cost is None:
        return find_path(free, start, goal)
    if max(free.shape) > 2 * coarse_size:
        path = _search_coarsely(free, start, goal, cost, coarse_size)
        if path is not None:
            return path
    return find_path(free, start, goal, cost[:, :])


def _search_coarsely(
    free: NDArray[np.bool_],
    start: tuple[int, int],
    goal: tuple[int, int],
    cost: Costs,
    coarse_size: int,
) -> NDArray[np.intp] | None:
    """Return the cheapest path near the cheapest one through blocks of pixels; None for none.

    A block is free where any of its pixels is.
    """
    from .compiled_search import find_path

    size = -(-max(free.shape) // coarse_size)
    coarse = any_in_blocks(free, *(np.arange(0, side, size) for side in free.shape))
    coarse_cost, cheapest = _mean_costs(cost, free.shape, size)
    source, target = ((u // size, v // size) for u, v in (start, goal))
    path = find_path(coarse, source, target, coarse_cost)
    if path is None:
        return None
    visited = np.zeros(coarse.shape, np.uint8)
    visited[path[:, 1], path[:, 0]] = 1
    band = cv2.dilate(visited, np.ones((2 * _BAND + 1, 2 * _BAND + 1), np.uint8)).view(np.bool_)
    # Nothing is looked at but the smallest window around the band.
    left, top = np.maximum(path.min(axis=0) - _BAND, 0).tolist()
    right, bottom = (path.max(axis=0) + _BAND + 1).tolist()
    rows, columns = slice(size * top, size * bottom), slice(size * left, size * right)
    near = free[rows, columns]
    fine = band[top:bottom, left:right].repeat(size, axis=0).repeat(size, axis=1)
    fine = fine[: near.shape[0], : near.shape[1]] & near
    first, last = ((u - columns.start, v - rows.start) for u, v in (start, goal))
    path = find_path(fine, first, last, cost[rows, columns], cheapest)
    return None if path is None else path + np.array((columns.start, rows.start))


def _mean_costs(
    cost: Costs, shape: tuple[int, ...], size: int
) -> tuple[NDArray[np.float32], float]:
    """Return the mean costs of blocks of pixels, and the least cost of a pixel."""
    width = -(-shape[1] // size)
    padding = width * size - shape[1]
    means, cheapest = [], np.inf
    for row in range(0, shape[0], size):
        strip = cost[row : row + size, :]
        cheapest = min(cheapest, float(strip.min()))
        strip = np.pad(strip, ((0, size - len(strip)), (0, padding)), mode="edge")
        means.append(strip.reshape(size, width, size).mean(axis=(0, 2)))
    return np.array(means), cheapest


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
