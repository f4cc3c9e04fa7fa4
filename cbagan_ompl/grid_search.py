"""Shortest paths over the free pixels of a grid, for the controls and for joining heat maps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from .segments import segment_is_free

#: Row and column offset of half of the eight neighbours; the graph is undirected.
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))
_NO_PREDECESSOR = -9999


def shortest_path(
    free: NDArray[np.bool_],
    start: tuple[int, int],
    goal: tuple[int, int],
    cost: NDArray[np.float32] | None = None,
) -> NDArray[np.intp] | None:
    """Cheapest 8-connected path between two pixels.

    A diagonal step needs both pixels beside it free, so that the path is a valid motion.

    Args:
        free: shape (H, W).
        start: (column, row) of a free pixel.
        goal: (column, row) of a free pixel.
        cost: price of a pixel length in each pixel, shape (H, W), positive; 1 by default. A step
            costs its length times the mean price of its two pixels.

    Returns:
        Pixels (column, row), shape (K, 2), both ends included; None where nothing joins them.
    """
    width = free.shape[1]
    source, target = start[1] * width + start[0], goal[1] * width + goal[0]
    graph = _grid_graph(free, np.ones(free.shape, np.float32) if cost is None else cost)
    _, predecessors = dijkstra(graph, directed=False, indices=source, return_predecessors=True)
    pixels = [target]
    while pixels[-1] != source:
        before = int(predecessors[pixels[-1]])
        if before == _NO_PREDECESSOR:
            return None
        pixels.append(before)
    indices = np.array(pixels[::-1], dtype=np.intp)
    return np.stack((indices % width, indices // width), axis=-1)


def _grid_graph(free: NDArray[np.bool_], cost: NDArray[np.float32]) -> csr_array:
    height, width = free.shape
    index = np.arange(free.size, dtype=np.int32).reshape(free.shape)
    tails, heads, weights = [], [], []
    for down, right in _STEPS:
        here = (slice(0, height - down), slice(max(0, -right), width - max(0, right)))
        there = (slice(down, height), slice(max(0, right), width + min(0, right)))
        passable = free[here] & free[there]
        if down and right:
            passable &= free[here[0], there[1]] & free[there[0], here[1]]
        tails.append(index[here][passable])
        heads.append(index[there][passable])
        weights.append(np.hypot(down, right) * 0.5 * (cost[here] + cost[there])[passable])
    return csr_array(
        (np.concatenate(weights), (np.concatenate(tails), np.concatenate(heads))),
        shape=(free.size, free.size),
    )


def pull_taut(free: NDArray[np.bool_], pixels: NDArray[np.intp]) -> NDArray[np.float64]:
    """Shorten a pixel path to straight segments that stay in free pixels.

    Args:
        free: shape (H, W).
        pixels: a path as returned by :func:`shortest_path`, shape (K, 2).

    Returns:
        Corner points of the shortened path at pixel centres, (u, v), shape (M, 2), M <= K.
    """
    height, width = free.shape
    cells = free.tobytes()
    points = (pixels + 0.5).tolist()
    corners = [points[0]]
    for here, ahead in pairwise(points[1:]):
        if not segment_is_free(cells, width, height, *corners[-1], *ahead):
            corners.append(here)
    corners.append(points[-1])
    return np.array(corners, dtype=np.float64)
