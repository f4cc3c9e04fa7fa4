"""Distance fields of learned costs: by a compiled function, or by NumPy where numba is missing."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

#: Returns the distances from start and goal, (2, H, W, K), for the costs of the steps between
#: cells, (4, H, W, K), and the cells of the endpoints, (B, 2, H, W).
DistanceFields = Callable[[NDArray[np.float32], NDArray[np.floating]], NDArray[np.float32]]

# Of cells that no path reaches.
_UNREACHED = np.float32(1e4)

# How far, in rows and columns, each cell's neighbours of the four kinds of steps are.
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))


@lru_cache(maxsize=1)
def compiled_fields() -> DistanceFields | None:
    """Return the compiled function; None where numba is missing, or cannot be used."""
    try:
        from .compiled_fields import distance_fields
    except Exception:  # no numba, or no folder in which it may keep what it compiles
        return None
    return distance_fields


def numpy_fields(
    edges: NDArray[np.float32], endpoints: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Return distance fields, arguments and result as of :func:`.compiled_fields.distance_fields`.

    Example:
        >>> endpoints = np.zeros((1, 2, 1, 3))
        >>> endpoints[0, 0, 0, 0] = endpoints[0, 1, 0, 2] = 1
        >>> numpy_fields(np.ones((4, 1, 3, 1), np.float32), endpoints)[0, 0, :, 0].tolist()
        [0.0, 1.0, 2.0]
    """
    _, height, width, count = edges.shape
    sources = np.repeat(np.transpose(endpoints > 0, (1, 2, 3, 0)), count // len(endpoints), axis=3)
    distances = np.where(sources, np.float32(0), _UNREACHED)
    costs = edges * np.sqrt([1, 1, 2, 2]).astype(np.float32)[:, None, None, None]
    pairs = []
    for (down, right), cost in zip(_STEPS, costs, strict=True):
        here = np.s_[:, 0 : height - down, max(0, -right) : width - max(0, right)]
        there = np.s_[:, down:height, max(0, right) : width + min(0, right)]
        pairs.append((distances[here], distances[there], cost[here[1:]]))
    while True:
        before = distances.copy()
        for one, other, cost in pairs:
            np.minimum(other, one + cost, out=other)
            np.minimum(one, other + cost, out=one)
        if np.array_equal(before, distances):
            return distances
