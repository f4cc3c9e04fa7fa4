"""Shortest paths by SciPy's Dijkstra, which the compiled searches must agree with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

# Row and column offset of half of the eight neighbours; the graph is undirected.
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))
_NO_PREDECESSOR = -9999


def search_graph(
    free: NDArray[np.bool_],
    start: tuple[int, int],
    goal: tuple[int, int],
    costs: NDArray[np.float32],
) -> NDArray[np.intp] | None:
    """Return the cheapest path, pixels (column, row), or None."""
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
