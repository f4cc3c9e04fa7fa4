"""Shortest paths over the free pixels of a grid, for the corridor and for repairing heat maps.

They are searched by compiled functions where numba is installed (the extra ``search``), else by
SciPy, which takes many times as long; :func:`search_kind` says which. Both find paths of the same
cost.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from types import ModuleType
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from .collision import segment_is_free

# Row and column offset of half of the eight neighbours; the graph is undirected.
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))
_NO_PREDECESSOR = -9999

# Coarse pixels to each side of the coarse path that make the band to search in.
_BAND = 3


#: What :func:`search_kind` returns.
COMPILED, SCIPY = "compiled", "SciPy"


def search_kind() -> str:
    """Return what paths are searched with here: :data:`COMPILED` or :data:`SCIPY`."""
    return SCIPY if _load_compiled() is None else COMPILED


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
    grids are searched around the path through a coarse grid first, so that their path may be a
    little costlier than the cheapest; the compiled search without costs needs no such help.

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
    is_large = max(free.shape) > 2 * coarse_size
    if is_large and (cost is not None or search_kind() == SCIPY):
        band = _coarse_band(free, start, goal, cost, coarse_size)
        path = None if band is None else _search(free & band, start, goal, cost)
        if path is not None:
            return path
    return _search(free, start, goal, cost)


def _coarse_band(
    free: NDArray[np.bool_],
    start: tuple[int, int],
    goal: tuple[int, int],
    cost: NDArray[np.float32] | None,
    coarse_size: int,
) -> NDArray[np.bool_] | None:
    """Return the pixels near the cheapest path through blocks of pixels.

    A block is free where any of its pixels is.
    """
    size = -(-max(free.shape) // coarse_size)
    padding = [(0, -side % size) for side in free.shape]
    blocks = np.pad(free, padding)
    shape = blocks.shape[0] // size, size, blocks.shape[1] // size, size
    coarse = np.asarray(blocks.reshape(shape).any(axis=(1, 3)))
    coarse_cost = (
        np.pad(_as_costs(cost, free.shape), padding, mode="edge").reshape(shape).mean(axis=(1, 3))
    )
    source, target = ((u // size, v // size) for u, v in (start, goal))
    path = _search(coarse, source, target, coarse_cost)
    if path is None:
        return None
    visited = np.zeros(coarse.shape, np.uint8)
    visited[path[:, 1], path[:, 0]] = 1
    band = cv2.dilate(visited, np.ones((2 * _BAND + 1, 2 * _BAND + 1), np.uint8))
    fine = band.repeat(size, axis=0).repeat(size, axis=1)[: free.shape[0], : free.shape[1]]
    return fine.astype(bool)


@lru_cache(maxsize=1)
def _load_compiled() -> ModuleType | None:
    """Return the compiled searches; None where numba is missing, or cannot be used."""
    try:
        from . import compiled_search
    except Exception:  # no numba, or no folder in which it may keep what it compiles
        return None
    return compiled_search


def _search(
    free: NDArray[np.bool_],
    start: tuple[int, int],
    goal: tuple[int, int],
    cost: NDArray[np.float32] | None,
) -> NDArray[np.intp] | None:
    compiled = _load_compiled()
    if compiled is not None:
        path: NDArray[np.intp] | None = compiled.find_path(free, start, goal, cost)
        return path
    return _search_graph(free, start, goal, _as_costs(cost, free.shape))


def _as_costs(cost: NDArray[np.float32] | None, shape: tuple[int, ...]) -> NDArray[np.float32]:
    return np.ones(shape, np.float32) if cost is None else cost


def _search_graph(
    free: NDArray[np.bool_],
    start: tuple[int, int],
    goal: tuple[int, int],
    costs: NDArray[np.float32],
) -> NDArray[np.intp] | None:
    """Search the free pixels by Dijkstra's algorithm (https://doi.org/10.1007/BF01386390)."""
    node = np.full(free.shape, -1, np.int32)
    pixels = np.flatnonzero(free)
    node.ravel()[pixels] = np.arange(len(pixels))
    source, target = (int(node[v, u]) for u, v in (start, goal))
    graph = _grid_graph(free, costs, node, len(pixels))
    _, predecessors = dijkstra(graph, directed=False, indices=source, return_predecessors=True)
    nodes = [target]
    while nodes[-1] != source:
        before = int(predecessors[nodes[-1]])
        if before == _NO_PREDECESSOR:
            return None
        nodes.append(before)
    rows, columns = np.divmod(pixels[nodes[::-1]], free.shape[1])
    return np.stack((columns, rows), axis=-1)


def _grid_graph(
    free: NDArray[np.bool_], costs: NDArray[np.float32], node: NDArray[np.int32], count: int
) -> csr_array:
    height, width = free.shape
    tails, heads, weights = [], [], []
    for down, right in _STEPS:
        here = (slice(0, height - down), slice(max(0, -right), width - max(0, right)))
        there = (slice(down, height), slice(max(0, right), width + min(0, right)))
        passable = free[here] & free[there]
        if down and right:
            passable &= free[here[0], there[1]] & free[there[0], here[1]]
        tails.append(node[here][passable])
        heads.append(node[there][passable])
        weights.append(np.hypot(down, right) * 0.5 * (costs[here] + costs[there])[passable])
    return csr_array(
        (np.concatenate(weights), (np.concatenate(tails), np.concatenate(heads))),
        shape=(count, count),
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
    compiled = _load_compiled()
    is_free: Callable[..., bool]
    cells: Any
    if compiled is None:
        is_free, cells = segment_is_free, free.tobytes()
    else:
        is_free, cells = compiled.segment_is_free_compiled, free.ravel()
    points = (pixels + 0.5).tolist()
    corners = [points[0]]
    for here, ahead in pairwise(points[1:]):
        if not is_free(cells, width, height, *corners[-1], *ahead):
            corners.append(here)
    corners.append(points[-1])
    return np.array(corners, dtype=np.float64)
