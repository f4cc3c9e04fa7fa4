"""The pixels of the worse nodes of :mod:`.passages`, compiled."""

from __future__ import annotations

from math import exp, log

import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled

_LOG_2 = log(2.0)


@compiled
def lowered_pixels(
    costs: NDArray[np.float32], codes: NDArray[np.int32], distances: NDArray[np.float32]
) -> NDArray[np.float32]:  # pragma: no cover
    """Return by how much the node of each pixel is worse than the best one of its patch.

    Args:
        costs: (B, 4, h, w), see :mod:`.passages`.
        codes: the same.
        distances: (B, 2, 4, h, w), the same.

    Returns:
        (B, h, w, 16), as :func:`.passage_generator.lowered_pixels`. Few patches have several nodes:
        that is why this is not done by operations on whole arrays.

    Example:
        >>> codes = np.array([[[[0x00FF]], [[0xFF00]], [[0]], [[0]]]], np.int32)
        >>> distances = np.ones((1, 2, 4, 1, 1), np.float32)
        >>> distances[0, :, 1] = 2.0
        >>> lowered = lowered_pixels(np.ones((1, 4, 1, 1), np.float32), codes, distances)
        >>> lowered[0, 0, 0, [0, 15]].astype(float).round(1).tolist()
        [0.0, -8.2]
    """
    batch, nodes, height, width = codes.shape
    result = np.zeros((batch, height, width, 16), np.float32)
    worse = np.empty(nodes, np.float32)
    for task in range(batch):
        own, cost, one, other = codes[task], costs[task], distances[task, 0], distances[task, 1]
        best = _least_sum(one, other, cost)
        unit = np.float32(0.05) * (best + np.float32(1.0)) + np.float32(0.25)
        for row in range(height):
            for column in range(width):
                if not (own[1, row, column] | own[2, row, column] | own[3, row, column]):
                    continue
                most = np.float32(-20.0)
                for node in range(nodes):
                    through = one[node, row, column] + other[node, row, column]
                    excess = (through - cost[node, row, column] - best) / unit
                    excess = min(max(excess, np.float32(0.02)), np.float32(8.0))
                    worse[node] = -log(exp(_LOG_2 * excess) - 1.0)
                    most = max(most, worse[node])
                for pixel in range(16):
                    value = np.float32(-20.0)
                    for node in range(nodes):
                        if (own[node, row, column] >> pixel) & 1:
                            value = max(value, worse[node] - most)
                    if value > -20.0:
                        result[task, row, column, pixel] = value
    return result


@compiled
def _least_sum(
    one: NDArray[np.float32], other: NDArray[np.float32], costs: NDArray[np.float32]
) -> np.float32:  # pragma: no cover
    """Return the least distance through any node, of the distances from start and from goal."""
    least = np.full(costs.shape[2], np.inf, np.float32)
    for node in range(costs.shape[0]):
        for row in range(costs.shape[1]):
            for column in range(costs.shape[2]):  # side by side
                through = one[node, row, column] + other[node, row, column]
                least[column] = min(least[column], through - costs[node, row, column])
    return np.float32(least.min())
